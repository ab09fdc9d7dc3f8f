# The observer one_mass_domain for a Makefile: `include` this file, compile one_mass_domain_SOURCES with one_mass_domain_CFLAGS and link with
# one_mass_domain_LIBS. Made by stiction 0.1.0 with: stiction generate one_mass_domain.yaml
one_mass_domain_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
one_mass_domain_SOURCES := $(one_mass_domain_DIR)one_mass_domain.c
one_mass_domain_CFLAGS := -std=c99 -ffp-contract=off -I$(one_mass_domain_DIR)
one_mass_domain_LIBS := -lm
