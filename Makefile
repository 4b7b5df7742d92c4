# The sample test day, one rule per step: make -j2 OUT=out. Results are byte for byte those of
# 'vdyn pipeline configs/pipeline.yaml'.
OUT  ?= out
VDYN ?= .venv/bin/vdyn
LOGS := $(wildcard sample_logs/*)
# False-alarm probability of each of the seven diagnoses: 0.05 / 7 (Bonferroni), so that of all together at most 5 %.
LEVEL := 0.007143
STEPS := area coastdown inertia cg bump tire shaft validate

.PHONY: all clean
all: $(STEPS:%=$(OUT)/%.json)

# Each step's result depends on the results that it reads parameters from.
$(OUT)/coastdown.json: $(OUT)/area.json
$(OUT)/inertia.json: $(OUT)/coastdown.json
$(OUT)/cg.json: $(OUT)/coastdown.json $(OUT)/inertia.json
$(OUT)/bump.json: $(OUT)/cg.json
$(OUT)/validate.json: $(patsubst %,$(OUT)/%.json,$(filter-out validate,$(STEPS)))

$(OUT)/%.json: configs/%.yaml configs/vehicle.yaml $(LOGS)
	$(VDYN) $* $< $(foreach known,$(filter $(OUT)/%.json,$^),--known $(known)) --level $(LEVEL) -o $(OUT) -q

clean:
	rm -rf $(OUT)
