# The observer two_mass_gto for a Makefile: `include` this file, compile two_mass_gto_SOURCES with two_mass_gto_CFLAGS and link with
# two_mass_gto_LIBS. Made by stiction 0.1.0 with: stiction generate two_mass_gto.yaml
two_mass_gto_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
two_mass_gto_SOURCES := $(two_mass_gto_DIR)two_mass_gto.c
two_mass_gto_CFLAGS := -std=c99 -ffp-contract=off -I$(two_mass_gto_DIR)
two_mass_gto_LIBS := -lm
