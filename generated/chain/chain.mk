# The observer chain for a Makefile: `include` this file, compile chain_SOURCES with chain_CFLAGS and link with
# chain_LIBS. Made by stiction 0.1.0 with: stiction generate chain.yaml
chain_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
chain_SOURCES := $(chain_DIR)chain.c
chain_CFLAGS := -std=c99 -ffp-contract=off -I$(chain_DIR)
chain_LIBS := -lm
