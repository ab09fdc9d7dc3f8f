# The observer seven_joint_arm for a Makefile: `include` this file, compile seven_joint_arm_SOURCES with seven_joint_arm_CFLAGS and link with
# seven_joint_arm_LIBS. Made by stiction 0.1.0 with: stiction generate seven_joint_arm.yaml
seven_joint_arm_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
seven_joint_arm_SOURCES := $(seven_joint_arm_DIR)seven_joint_arm.c
seven_joint_arm_CFLAGS := -std=c99 -ffp-contract=off -I$(seven_joint_arm_DIR)
seven_joint_arm_LIBS := -lm
