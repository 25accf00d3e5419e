# What people type. `make help` lists it; CMake does the work (CMakePresets.json for everything else).
BUILD ?= build
JOBS ?= $(shell nproc)
PREFIX ?= /usr/local
DEVICES ?= auto

.PHONY: help deps build tests test demo fig14 fig15 bench bundle install format lint clean

help:            ## this list
	@grep -hE '^[a-z0-9]+: .*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z0-9]+):.*## /  make \1\t/' | expand -t 18

deps:            ## install missing Debian packages (asks sudo when not root)
	@tools/install_deps.sh

build: deps      ## the program, at build/tactus
	@tools/configure.sh $(BUILD) -DTACTUS_TESTS=OFF
	cmake --build $(BUILD) -j $(JOBS) --target tactus

tests: deps      ## the program and every test
	@tools/install_deps.sh all
	@tools/configure.sh $(BUILD) -DTACTUS_TESTS=ON
	cmake --build $(BUILD) -j $(JOBS)

test: tests      ## build and run every test; the last line counts them
	@tools/run_tests.py $(BUILD)

demo: build      ## a hand presses a soft slab: out/demo.mp4, out/demo.png and a table of milliseconds
	$(BUILD)/tactus run scenes/demo.yaml --devices $(DEVICES) --out out --view file --json out/demo.json

fig14: build     ## the paper's figure 14, a figure and a hand textured: out/fig14.png (needs TACTUS_DATA)
	@mkdir -p out
	$(BUILD)/tactus paper fig14 --devices $(DEVICES) --out out/fig14.png

fig15: build     ## the paper's figure 15, the hull without and with depth: out/fig15.png
	@mkdir -p out
	$(BUILD)/tactus paper fig15 --devices $(DEVICES) --out out/fig15.png

bench: build     ## all benchmarks as a table and out/bench.json
	@mkdir -p out
	$(BUILD)/tactus bench all --devices $(DEVICES) --json out/bench.json

bundle: tests    ## bundle/ with two relocatable archives: tactus-device (GPU tests, bench) and tactus (all)
	@tools/make_bundle.sh $(BUILD) bundle

install: build   ## library, headers and program to PREFIX
	cmake --install $(BUILD) --prefix $(PREFIX)

format:          ## clang-format all sources
	git ls-files '*.h' '*.cpp' '*.cu' '*.cuh' | xargs clang-format -i

lint:            ## format, include direction, kernels' rules, headers alone, clang-tidy
	@tools/lint.sh

clean:           ## remove what was built
	rm -rf $(BUILD) build-tidy build-cpu-asan bundle out
