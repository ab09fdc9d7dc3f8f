# The observer one_mass_cfo_semi_implicit for a Makefile: `include` this file, compile one_mass_cfo_semi_implicit_SOURCES with one_mass_cfo_semi_implicit_CFLAGS and link with
# one_mass_cfo_semi_implicit_LIBS. Made by stiction 0.1.0 with: stiction generate one_mass_cfo_semi_implicit.yaml
one_mass_cfo_semi_implicit_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
one_mass_cfo_semi_implicit_SOURCES := $(one_mass_cfo_semi_implicit_DIR)one_mass_cfo_semi_implicit.c
one_mass_cfo_semi_implicit_CFLAGS := -std=c99 -ffp-contract=off -I$(one_mass_cfo_semi_implicit_DIR)
one_mass_cfo_semi_implicit_LIBS := -lm
