# The observer two_link_arm for a Makefile: `include` this file, compile two_link_arm_SOURCES with two_link_arm_CFLAGS and link with
# two_link_arm_LIBS. Made by stiction 0.1.0 with: stiction generate two_link_arm.yaml
two_link_arm_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
two_link_arm_SOURCES := $(two_link_arm_DIR)two_link_arm.c
two_link_arm_CFLAGS := -std=c99 -ffp-contract=off -I$(two_link_arm_DIR)
two_link_arm_LIBS := -lm
