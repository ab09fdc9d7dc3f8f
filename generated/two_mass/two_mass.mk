# The observer two_mass for a Makefile: `include` this file, compile two_mass_SOURCES with two_mass_CFLAGS and link with
# two_mass_LIBS. Made by stiction 0.1.0 with: stiction generate two_mass.yaml
two_mass_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
two_mass_SOURCES := $(two_mass_DIR)two_mass.c
two_mass_CFLAGS := -std=c99 -ffp-contract=off -I$(two_mass_DIR)
two_mass_LIBS := -lm
