# The firmware that docs/hand_step.md prints, out of its text: its blocks of C, the calls of the second one as two
# functions, and then the board.

GUIDE := ../../docs/hand_step.md

$(BUILD)/guide.c: $(GUIDE) guide_board.c guide.mk | $(AWIWI_BUILD)
	awk '/^```/ {inside = /^```c$$/; blocks += inside; next} \
	     inside && blocks == 2 && /^awiwi_/ {calls++; \
	       $$0 = "static void " (calls == 1 ? "begin_log" : "log_tick") "(const awiwi_real *pose)\n{\n(void)pose;\n" $$0 "\n}"} \
	     inside' $(GUIDE) > $@
	cat guide_board.c >> $@

$(BUILD)/guide.o: $(BUILD)/guide.c meter.h $(AWIWI_HEADERS)
	$(CC) -I. $(AWIWI_CPPFLAGS) $(CFLAGS) $(AWIWI_CFLAGS) -c $< -o $@
