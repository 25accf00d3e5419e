# What people type. `make help` lists it; CMake does the work (CMakePresets.json for everything else).
BUILD ?= build
JOBS ?= $(shell nproc)
PREFIX ?= /usr/local
DEVICES ?= auto
# Debian's Python has Debian's numpy, whatever stands before it in the path.
PYTHON ?= $(or $(wildcard /usr/bin/python3),python3)
# More for cmake: CONFIGURE='-DCMAKE_CUDA_ARCHITECTURES=90-real;75-virtual'
CONFIGURE ?=
# What is left, and for how long it has run.
export NINJA_STATUS ?= [%p, %u of %t left, %e s] 

.PHONY: help deps pictures build benchmarks complete web python api tests test demo fig14 fig15 bench bundle testbundle install format lint clean

help:            ## this list
	@grep -hE '^[a-z0-9]+: .*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z0-9]+):.*## /  make \1\t/' | expand -t 18

deps:            ## install missing Debian packages (asks sudo when not root)
	@tools/install_deps.sh

build: deps      ## the program, at build/tactus
	@tools/configure.sh $(BUILD) -DTACTUS_TESTS=OFF $(if $(CONFIGURE),'$(CONFIGURE)')
	cmake --build $(BUILD) -j $(JOBS) --target tactus

benchmarks: build
	cmake --build $(BUILD) -j $(JOBS) --target tactus-bench

tests:           ## the program and every test
	@tools/install_deps.sh tests
	@tools/configure.sh $(BUILD) -DTACTUS_TESTS=ON -DTACTUS_PYTHON=ON $(if $(CONFIGURE),'$(CONFIGURE)')
	cmake --build $(BUILD) -j $(JOBS)

test: tests      ## build and run every test; the last line counts them
	@tools/run_tests.py $(BUILD)

python:          ## the Python module, at build/python, and its tests
	@tools/install_deps.sh python
	@tools/configure.sh $(BUILD) -DTACTUS_TESTS=OFF -DTACTUS_PYTHON=ON $(if $(CONFIGURE),'$(CONFIGURE)')
	cmake --build $(BUILD) -j $(JOBS) --target tactus tactus_python
	PYTHONPATH=$(BUILD)/python TACTUS_SOURCE_DIR=. TACTUS_PROGRAM=$(BUILD)/tactus $(PYTHON) -m pytest -q python/tests

complete:        ## the program with live cameras, calibration, markers, TIFF and TOML, at build/tactus
	@tools/install_deps.sh complete
	@tools/configure.sh $(BUILD) -DTACTUS_TESTS=OFF
	@cmake -S . -B $(BUILD) >/dev/null  # looks for the libraries again
	cmake --build $(BUILD) -j $(JOBS) --target tactus

web:             ## the program with --web (docs/web.md), at build/tactus
	@tools/install_deps.sh web
	@tools/configure.sh $(BUILD) -DTACTUS_TESTS=OFF
	@cmake -S . -B $(BUILD) >/dev/null  # looks for the libraries again
	cmake --build $(BUILD) -j $(JOBS) --target tactus

demo: build      ## a hand presses a soft slab: out/demo.mp4, out/demo.png and a table of milliseconds
	$(BUILD)/tactus run scenes/demo.yaml --devices $(DEVICES) --out out --view file --json out/demo.json

view:            ## a window on the demo that you orbit, pause and touch: docs/live_view.md
	@tools/install_deps.sh view
	@tools/configure.sh $(BUILD) -DTACTUS_TESTS=OFF $(if $(CONFIGURE),'$(CONFIGURE)')
	@cmake -S . -B $(BUILD) >/dev/null  # looks for the libraries again
	cmake --build $(BUILD) -j $(JOBS) --target tactus
	$(BUILD)/tactus view scenes/demo.yaml --devices $(DEVICES)

fig14: build     ## the paper's figure 14, a figure and a hand textured: out/fig14.png (needs TACTUS_DATA)
	@mkdir -p out
	$(BUILD)/tactus paper fig14 --devices $(DEVICES) --out out/fig14.png

fig15: build     ## the paper's figure 15, the hull without and with depth: out/fig15.png
	@mkdir -p out
	$(BUILD)/tactus paper fig15 --devices $(DEVICES) --out out/fig15.png

pictures: build  ## pictures of the documents that scenes make, anew in docs/images (some minutes)
	@tools/docs_pictures.sh $(BUILD)/tactus $(DEVICES)

bench: benchmarks ## all benchmarks as a table and out/bench.json
	@mkdir -p out
	$(BUILD)/tactus bench all --devices $(DEVICES) --json out/bench.json

bundle: deps     ## bundle/ with .debs of program and Python module, and an archive of the program, for machines without a compiler
	@tools/install_deps.sh python
	@tools/configure.sh build-package -DTACTUS_TESTS=OFF -DTACTUS_PACKAGE=ON -DTACTUS_PYTHON=ON
	cmake --build build-package -j $(JOBS) --target tactus tactus-bench tactus_python
	@tools/make_package.sh build-package bundle

testbundle: tests ## bundle/ with two relocatable archives to test elsewhere: tactus-device (GPU tests, bench) and tactus (all)
	@tools/make_bundle.sh $(BUILD) bundle

install: build   ## program, man page, completions, scenes, library and headers to PREFIX
	cmake --install $(BUILD) --prefix $(PREFIX)

api:             ## pages of the headers that programs use: out/api/html/index.html (needs doxygen)
	@mkdir -p out
	doxygen docs/Doxyfile

format:          ## clang-format all sources
	git ls-files '*.h' '*.cpp' '*.cu' '*.cuh' | xargs clang-format -i

lint:            ## format, includes, headers alone, prose, clang-tidy of what changed (lint ALL=1: of everything)
	@tools/lint.sh $(if $(ALL),--all)

clean:           ## remove what was built
	rm -rf $(BUILD) build-tidy build-package build-cpu-asan bundle out
