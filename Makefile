# SPDX-License-Identifier: Apache-2.0
# The menu. Every target calls a script in scripts/ or the command line it built; nothing is computed here.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.NOTPARALLEL:
MAKEFLAGS += --no-print-directory

BUILD := build
export JOBS VERBOSE MINUTES T SEED SEEDS SETUP STAGE CFG PLANE CELL

# What the vendor flows take.
FLOW_OPTIONS = $(if $(BOARD),--board $(BOARD)) $(if $(TOP),--top $(TOP)) $(if $(CFG),--config $(CFG)) $(GENERICS)

.PHONY: help
help: ## This list
	@sed -nE 's/^([a-z-]+):.*## (.*)/  make \1\t\2/p' Makefile | expand -t 23
	@echo '  All of them: JOBS=n (default: all cores), VERBOSE=1, SETUP=no (do not install packages)'

.PHONY: setup
setup: ## Install the Debian packages that are missing (all other targets do this by themselves)
	@scripts/setup.sh build

.PHONY: build
build: setup ## Build everything; the command line is build/psweep
	@scripts/build.sh

.PHONY: demo
demo: setup ## Render a scene, depth by float, fixed and RTL, compare, evaluate: build/demo/
	@scripts/build.sh psweep
	@scripts/demo.sh

.PHONY: demo-full
demo-full: setup ## The same at 1120x1120 with 301 planes, every tile through the RTL: build/demo-full/
	@scripts/build.sh psweep
	@scripts/demo.sh --full

.PHONY: sim
sim: build ## The regression, RTL bit-exact with the model   T=<regex of test names> SEED=n
	@scripts/sim.sh

.PHONY: sim-net
sim-net: setup ## The simulated chip behind the kernel's network stack: ping, a whole pair over UDP, byte for byte
	@scripts/setup.sh net
	@scripts/build.sh psweep psweep-sim
	@scripts/sim_net.sh

.PHONY: sim-ghdl
sim-ghdl: build ## More recorded streams on the original VHDL in GHDL: every configuration, more tiles   SEEDS='2 3'
	@scripts/sim_ghdl.sh

.PHONY: rules
rules: build ## The assertions in the VHDL speak when they should: a fault each, in GHDL (10 s)
	@scripts/rules.sh

.PHONY: flips
flips: setup ## Upsets of single bits in control, plane table, map: nothing hangs (a minute)   ALL=1: all registers
	@scripts/build.sh flips
	@scripts/flips.sh $(if $(ALL),--all) $(if $(SEED),--seed $(SEED))

.PHONY: flips-chip
flips-chip: setup ## 20,000 upsets of the whole chip, tiles on its link: nothing hangs (10 minutes)   COUNT=n SEED=n
	@scripts/build.sh chip_flips
	@scripts/flips_chip.py $(if $(COUNT),--count $(COUNT)) $(if $(SEED),--seed $(SEED))

.PHONY: soak
soak: setup ## Random tiles, good and bad, with stalls and resets: all is counted   TILES=10000 SEED=n
	@scripts/build.sh soak
	@scripts/soak.sh $(if $(TILES),--tiles $(TILES)) $(if $(SEED),--seed $(SEED))

.PHONY: sweep
sweep: setup ## Engines of random sizes and formats, each built and tried (5 minutes)   COUNT=10 SEED=n
	@scripts/sweep.sh $(if $(COUNT),--count $(COUNT)) $(if $(SEED),--seed $(SEED))

.PHONY: sim-gates
sim-gates: setup ## The netlist for Virtex-6 at gate level, bit-exact with recorded streams; broken cells are noticed
	@scripts/setup.sh gates cost
	@scripts/build.sh record_engine
	@scripts/sim_gates.sh

.PHONY: cost
cost: setup ## LUT, FF, RAM, DSP of the engines beside the paper's, by Yosys (minutes)   CFG=tile FAMILY=xc6v,.. ALL=1
	@scripts/setup.sh cost
	@scripts/build.sh shape_table link_table
	@scripts/cost/report.py $(if $(CFG),--config $(CFG)) $(if $(ALL),--all) $(if $(FAMILY),--family $(FAMILY))

.PHONY: cost-check
cost-check: setup ## All counts again (ten minutes): are they those of docs/cost.md? Growth fails
	@scripts/setup.sh cost
	@scripts/cost/report.py --check

.PHONY: cost-update
cost-update: setup ## All counts again into scripts/cost/baseline.json, docs/cost.md, docs/datasheet.md, the picture
	@scripts/setup.sh cost
	@scripts/build.sh shape_table link_table
	@scripts/cost/report.py --update

.PHONY: dse
dse: setup ## Design space: resources, clocks, accuracy, resumable: build/dse/index.html   GRID=file SLURM=1 PAGES=1
	@$(if $(and $(PAGES),$(GRID)),echo 'dse: PAGES=1 is for the default grid' >&2; exit 2,true)
	@scripts/setup.sh cost dse
	@scripts/build.sh psweep shape_table psweep_accuracy
	@scripts/dse/dse.sh $(if $(GRID),--grid $(GRID)) $(if $(SLURM),--slurm)
	@$(if $(PAGES),scripts/dse/pages.py --take build/dse,true)

.PHONY: dse-check
dse-check: setup ## The workflow of make dse: killed and resumed; one source changed, only its dependants run
	@scripts/setup.sh cost dse
	@scripts/build.sh psweep shape_table psweep_accuracy
	@scripts/dse/test_workflow.sh

.PHONY: dse-slurm-check
dse-slurm-check: setup ## The same on a one-node Slurm of this machine: as root, packages slurm-wlm and munge
	@scripts/setup.sh cost dse
	@scripts/build.sh psweep shape_table psweep_accuracy
	@scripts/dse/one_node.sh scripts/dse/test_workflow.sh --slurm

.PHONY: pnr
pnr: ## Maximum clock on ECP5-85 by nextpnr, three placements, units and engine (half an hour)   CFG=tile SEEDS=1,2,3
	@scripts/setup.sh build cost
	@scripts/cost/pnr.py --units --config $(or $(CFG),tile) $(if $(SEEDS),--seeds $(SEEDS)) G_SPLIT=1

.PHONY: pnr-update
pnr-update: ## The table of docs/cost.md that make pnr is about: nine engines and units (an hour)
	@scripts/setup.sh build cost
	@scripts/cost/report.py --pnr

.PHONY: ise
ise: ## Vendor flow, Virtex-5QV and -6: ISE 14.7   BOARD=ml605 TOP=psweep CFG=tile GENERICS='G_X=n ..'
	@scripts/ise/ise.py $(FLOW_OPTIONS)

.PHONY: nxmap
nxmap: ## Vendor flow, NG-MEDIUM: NanoXplore's nxpython   TOP=psweep CFG=tile GENERICS='G_X=n ..'
	@scripts/nxmap/nxmap.py $(FLOW_OPTIONS)

.PHONY: check-flows
check-flows: ## Vendor flows, constraints, FuseSoC cores checked without the vendors' tools   FUSESOC=1 STA=1
	@scripts/setup.sh build flows
	@scripts/check_flows.py
	@scripts/check_flows.py --faults
	@$(if $(FUSESOC),scripts/check_flows.py --fusesoc,true)
	@$(if $(STA),scripts/setup.sh sta && scripts/flows/sta.py,true)

.PHONY: real
real: setup ## Real stereo pairs through float, fixed and RTL   DATA=<folder>: build/real/
	@scripts/build.sh psweep
	@scripts/real.sh '$(DATA)'

.PHONY: config
config: setup ## Build one more RTL configuration   NAME=w9 WINDOW=9 ..: keys of rtl/configs/engine.schema.json
	@scripts/configurations.py new $(filter-out JOBS=% VERBOSE=% SETUP=%,$(MAKEOVERRIDES))
	@scripts/build.sh psweep

.PHONY: bench
bench: setup ## Speed of the float reference, the bit-true model and the simulated RTL on this machine
	@scripts/build.sh psweep psweep_bench one_tile
	@scripts/bench.sh

.PHONY: accuracy
accuracy: setup ## Float and fixed against the truth, nine scenes, and every number format (half an hour)
	@scripts/build.sh psweep_accuracy
	@echo 'accuracy: scenes'; build/sw/app/psweep_accuracy --seeds 1,2,3 cleanup fixed rules
	@echo 'accuracy: unseen'; build/sw/app/psweep_accuracy --seeds 11,12,13 cleanup fixed
	@echo 'accuracy: formats'; build/sw/app/psweep_accuracy --seeds 1 formats mncc

.PHONY: waves
waves: setup ## Waves of one cell, and its values at every stage   STAGE=similarity CFG=tiny PLANE=6 CELL=8,6
	@scripts/build.sh psweep-waves
	@scripts/waves.sh

.PHONY: wave-pictures
wave-pictures: ## The pictures of docs/waves.md again, by GTKWave without a screen
	@scripts/setup.sh build waves
	@scripts/build.sh psweep-waves
	@scripts/wave_pictures.sh

.PHONY: sim-large
sim-large: setup ## One tile of 2048x2048 cells, and one of 1024 planes, through an engine of that size (a minute)
	@scripts/large.sh

.PHONY: formal
formal: ## Prove properties of the clock crossings and other small circuits, and find the faults put into them
	@scripts/setup.sh build formal
	@scripts/formal.sh

.PHONY: lint
lint: ## Check texts, VHDL, C++ layout, converted Verilog, scripts and folders
	@scripts/setup.sh build lint
	@scripts/lint.sh

.PHONY: format
format: ## Lay out the C++ with clang-format
	@scripts/setup.sh lint
	@scripts/lint.sh --format

.PHONY: docs
docs: ## The pages as a site with search, links checked: build/docs/index.html
	@scripts/setup.sh docs
	@scripts/docs/site.py

.PHONY: fresh-machine
fresh-machine: ## README's commands in a bare Debian root   SUITE=bookworm|trixie (root only)
	@scripts/fresh_machine.sh $(or $(SUITE),bookworm)

.PHONY: mac-opinion
mac-opinion: ## The MAC against the MII models of cocotbext-eth in Icarus (fetches both Python packages once)
	@scripts/setup.sh build opinion
	@scripts/mac_opinion.sh

.PHONY: evidence
evidence: ## Measures again what is stale of the pages' figures; goes on where it was   KIND='a b' FORCE=1 MINUTES=n
	@scripts/setup.sh build evidence
	@scripts/evidence.py run $(if $(FORCE),--force) $(KIND)

.PHONY: evidence-status
evidence-status: ## Which of it is stale, and since which change
	@scripts/evidence.py status $(KIND)

.PHONY: mutants
mutants: setup ## Small faults in a copy of the RTL: the tests find them   E=<entities> SEED=n COUNT=n MINUTES=n
	@scripts/setup.sh evidence
	@scripts/mutants.sh $(if $(SEED),--seed $(SEED)) $(if $(COUNT),--count $(COUNT)) \
	  $(if $(MINUTES),--minutes $(MINUTES)) $(E)

.PHONY: coverage
coverage: setup ## Lines of VHDL (GHDL 4 or newer) and bits that the tests reach: build/coverage/
	@scripts/coverage.sh

.PHONY: coverage-lines coverage-toggles
coverage-lines coverage-toggles: coverage-%: setup
	@scripts/coverage.sh $*

.PHONY: link-speed
link-speed: setup ## Goodput, latency, busy share of the engine and time of a whole pair, on the simulated chip
	@scripts/build.sh link_speed test_goodput
	@scripts/link_speed.sh

.PHONY: link-table
link-table: setup ## RAM of the arbiter's buffers against stall clocks, for bands and tiles, duplex, clocks and lanes
	@scripts/build.sh link_table
	@build/link_table

.PHONY: shape-table
shape-table: setup ## Clocks of the paper's pair against memory, for bands and tiles of every shape (a minute)
	@scripts/setup.sh build plots
	@scripts/build.sh shape_table
	@scripts/shape_table.sh

.PHONY: fuzz
fuzz: setup ## Random and mutated frames into the simulated chips, packets into the host   FRAMES=100000 SEED=n
	@scripts/build.sh test_fuzz test_net_fuzz
	@scripts/fuzz.sh $(FRAMES)

.PHONY: clean
clean: ## Remove build/
	rm -rf $(BUILD)
