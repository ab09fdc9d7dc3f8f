# The observer one_mass for a Makefile: `include` this file, compile one_mass_SOURCES with one_mass_CFLAGS and link with
# one_mass_LIBS. Made by stiction 0.1.0 with: stiction generate one_mass.yaml
one_mass_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
one_mass_SOURCES := $(one_mass_DIR)one_mass.c
one_mass_CFLAGS := -std=c99 -ffp-contract=off -I$(one_mass_DIR)
one_mass_LIBS := -lm
