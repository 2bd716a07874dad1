# Makefile fragment. Set AWIWI_GENERATED to a generated directory, then include this file:
#
#     AWIWI_GENERATED := firmware/generated
#     include path/to/csrc/awiwi.mk
#     firmware.elf: main.o $(AWIWI_OBJECTS)
#
# AWIWI_BUILD is where objects go (default build/awiwi). AWIWI_CPPFLAGS is what users of the headers need.
# AWIWI_CFLAGS has the flags on which bits and cost depend; your CFLAGS add the processor and the optimisation.

AWIWI_CSRC := $(patsubst %/,%,$(dir $(lastword $(MAKEFILE_LIST))))
AWIWI_GENERATED ?= $(AWIWI_CSRC)/../generated
AWIWI_BUILD ?= build/awiwi
AWIWI_CPPFLAGS := -I$(AWIWI_GENERATED) -I$(AWIWI_CSRC)
AWIWI_CFLAGS := -std=c99 -ffp-contract=off -fno-math-errno
AWIWI_SOURCES := $(wildcard $(AWIWI_GENERATED)/*.c) $(wildcard $(AWIWI_CSRC)/*.c)
AWIWI_HEADERS := $(wildcard $(AWIWI_GENERATED)/*.h) $(wildcard $(AWIWI_CSRC)/*.h)
AWIWI_OBJECTS := $(addprefix $(AWIWI_BUILD)/,$(notdir $(AWIWI_SOURCES:.c=.o)))

$(AWIWI_BUILD)/%.o: $(AWIWI_GENERATED)/%.c $(AWIWI_HEADERS) | $(AWIWI_BUILD)
	$(CC) $(CPPFLAGS) $(AWIWI_CPPFLAGS) $(CFLAGS) $(AWIWI_CFLAGS) -c $< -o $@

$(AWIWI_BUILD)/%.o: $(AWIWI_CSRC)/%.c $(AWIWI_HEADERS) | $(AWIWI_BUILD)
	$(CC) $(CPPFLAGS) $(AWIWI_CPPFLAGS) $(CFLAGS) $(AWIWI_CFLAGS) -c $< -o $@

$(AWIWI_BUILD):
	mkdir -p $@
