# The observer one_mass_dfo for a Makefile: `include` this file, compile one_mass_dfo_SOURCES with one_mass_dfo_CFLAGS and link with
# one_mass_dfo_LIBS. Made by stiction 0.1.0 with: stiction generate one_mass_dfo.yaml
one_mass_dfo_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
one_mass_dfo_SOURCES := $(one_mass_dfo_DIR)one_mass_dfo.c
one_mass_dfo_CFLAGS := -std=c99 -ffp-contract=off -I$(one_mass_dfo_DIR)
one_mass_dfo_LIBS := -lm
