# The hand as a program of this machine: make -f posix.mk run

BUILD ?= build/posix
AWIWI_BUILD := $(BUILD)/awiwi
CFLAGS := -O2

all: $(BUILD)/hand

include ../../csrc/awiwi.mk

$(BUILD)/hand: $(BUILD)/hand.o $(BUILD)/meter.o $(AWIWI_OBJECTS)
	$(CC) $(filter %.o,$^) -lm -o $@

$(BUILD)/%.o: %.c meter.h $(AWIWI_HEADERS) | $(AWIWI_BUILD)
	$(CC) $(AWIWI_CPPFLAGS) $(CFLAGS) $(AWIWI_CFLAGS) -c $< -o $@

run: $(BUILD)/hand
	@$(BUILD)/hand

.PHONY: all run
