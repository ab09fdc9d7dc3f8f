# The observer emps for a Makefile: `include` this file, compile emps_SOURCES with emps_CFLAGS and link with
# emps_LIBS. Made by stiction 0.1.0 with: stiction generate emps.yaml
emps_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
emps_SOURCES := $(emps_DIR)emps.c
emps_CFLAGS := -std=c99 -ffp-contract=off -I$(emps_DIR)
emps_LIBS := -lm
