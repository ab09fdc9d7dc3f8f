# The observer two_mass_gdfo for a Makefile: `include` this file, compile two_mass_gdfo_SOURCES with two_mass_gdfo_CFLAGS and link with
# two_mass_gdfo_LIBS. Made by stiction 0.1.0 with: stiction generate two_mass_gdfo.yaml
two_mass_gdfo_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
two_mass_gdfo_SOURCES := $(two_mass_gdfo_DIR)two_mass_gdfo.c
two_mass_gdfo_CFLAGS := -std=c99 -ffp-contract=off -I$(two_mass_gdfo_DIR)
two_mass_gdfo_LIBS := -lm
