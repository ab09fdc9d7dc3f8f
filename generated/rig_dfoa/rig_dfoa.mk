# The observer rig_dfoa for a Makefile: `include` this file, compile rig_dfoa_SOURCES with rig_dfoa_CFLAGS and link with
# rig_dfoa_LIBS. Made by stiction 0.1.0 with: stiction generate rig_dfoa.yaml
rig_dfoa_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
rig_dfoa_SOURCES := $(rig_dfoa_DIR)rig_dfoa.c
rig_dfoa_CFLAGS := -std=c99 -ffp-contract=off -I$(rig_dfoa_DIR)
rig_dfoa_LIBS := -lm
