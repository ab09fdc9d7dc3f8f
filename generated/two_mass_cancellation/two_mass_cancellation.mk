# The observer two_mass_cancellation for a Makefile: `include` this file, compile two_mass_cancellation_SOURCES with two_mass_cancellation_CFLAGS and link with
# two_mass_cancellation_LIBS. Made by stiction 0.1.0 with: stiction generate two_mass_cancellation.yaml
two_mass_cancellation_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
two_mass_cancellation_SOURCES := $(two_mass_cancellation_DIR)two_mass_cancellation.c
two_mass_cancellation_CFLAGS := -std=c99 -ffp-contract=off -I$(two_mass_cancellation_DIR)
two_mass_cancellation_LIBS := -lm
