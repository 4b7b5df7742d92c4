# The sample day with one rule a step: make -j2 OUT=out. The same bytes as 'vdyn pipeline configs/pipeline.yaml'.
OUT  ?= out
VDYN ?= .venv/bin/vdyn
LOGS := $(wildcard sample_logs/*)
# What each diagnosis may cost in false alarms, so that all together keep to 5 %.
LEVEL := 0.007143
STEPS := area coastdown inertia cg bump tire shaft validate

.PHONY: all clean
all: $(STEPS:%=$(OUT)/%.json)

# What a step needs of others, each the result of its own rule.
$(OUT)/coastdown.json: $(OUT)/area.json
$(OUT)/inertia.json: $(OUT)/coastdown.json
$(OUT)/cg.json: $(OUT)/coastdown.json $(OUT)/inertia.json
$(OUT)/bump.json: $(OUT)/cg.json
$(OUT)/validate.json: $(patsubst %,$(OUT)/%.json,$(filter-out validate,$(STEPS)))

$(OUT)/%.json: configs/%.yaml configs/vehicle.yaml $(LOGS)
	$(VDYN) $* $< $(foreach known,$(filter $(OUT)/%.json,$^),--known $(known)) --level $(LEVEL) -o $(OUT) -q

clean:
	rm -rf $(OUT)
