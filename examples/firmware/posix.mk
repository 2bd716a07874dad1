# The hand as a program of this machine: make -f posix.mk run; the firmware of docs/hand_step.md: run-guide

BUILD ?= build/posix
AWIWI_BUILD := $(BUILD)/awiwi
CFLAGS := -O2

all: $(BUILD)/hand

include ../../csrc/awiwi.mk
include guide.mk

$(BUILD)/hand: $(BUILD)/hand.o $(BUILD)/meter.o $(AWIWI_OBJECTS)
	$(CC) $(filter %.o,$^) -lm -o $@

$(BUILD)/%.o: %.c meter.h $(AWIWI_HEADERS) | $(AWIWI_BUILD)
	$(CC) $(AWIWI_CPPFLAGS) $(CFLAGS) $(AWIWI_CFLAGS) -c $< -o $@

run: $(BUILD)/hand
	@$(BUILD)/hand

$(BUILD)/guide: $(BUILD)/guide.o $(BUILD)/meter.o $(AWIWI_OBJECTS)
	$(CC) $(filter %.o,$^) -lm -o $@

run-guide: $(BUILD)/guide
	@$(BUILD)/guide $(LOG)

.PHONY: all run run-guide
