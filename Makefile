# Each target installs what is missing on a new Debian or Ubuntu machine.
# The work is done in scripts/, which also support folders with spaces in their names.

.PHONY: demo test build lint format sanitize fuzz fmu bench benchmarks win64 aarch64-linux darwin64 wasm interop memcheck docs wheel coverage tidy clean distclean help

demo: ## build the KUKA KR5 FMU, simulate it, leave a plot and a CSV in out/
	@sh scripts/demo.sh

test: ## lint, C++ tests and Python tests
	@sh scripts/test.sh

build: ## the shared library and `describe`, in build/release
	@sh scripts/build.sh release redysim_fmu describe

lint: ## module dependencies, sizes of files and functions, layout of Python and C++
	@sh scripts/lint.sh

format: ## let ruff and clang-format lay out the Python and C++ files
	@sh scripts/lint.sh --fix

sanitize: ## the C++ tests under address and undefined-behaviour sanitizers, those with threads under the thread sanitizer
	@sh scripts/sanitize.sh

memcheck: ## complete instance lifetimes under Valgrind
	@sh scripts/memcheck.sh

fuzz: ## libFuzzer for a minute on model files, saved states and call sequences
	@sh scripts/fuzz.sh

fmu: ## every model in models/ as an FMU in out/, validated and simulated by FMPy
	@sh scripts/fmu.sh

bench: ## all figures and plots of docs/performance.md and the other measured pages, in out/bench
	@sh scripts/bench.sh

benchmarks: ## the IFToMM multibody benchmarks of docs/benchmarks.md in out/bench
	@sh scripts/bench.sh --stages benchmarks

docs: ## the docs as a site in out/site, with the pages of the C++ headers
	@sh scripts/docs.sh

wheel: ## the Python package with the compiled library in out/wheel, tested in an empty environment; after `make win64` also for Windows
	@sh scripts/wheel.sh

tidy: ## clang-tidy on the C++ files
	@sh scripts/tidy.sh

coverage: ## line coverage of C++ and Python by the tests, in out/coverage
	@sh scripts/coverage.sh

win64: ## the library for 64-bit Windows in build/win64, run under Wine
	@sh scripts/cross.sh win64

aarch64-linux: ## the library for Linux on 64-bit Arm processors in build/aarch64-linux, run under QEMU
	@sh scripts/cross.sh aarch64-linux

darwin64: ## the library for macOS on x86-64 in build/darwin64, linked by zig; it cannot run here
	@sh scripts/cross.sh darwin64

wasm: ## the library for the page of `build-fmu show --live` in build/wasm, run by Node and Chromium
	@sh scripts/cross.sh wasm

interop: ## the FMUs in other masters: Ecos, libcosim, FMU containers, FMI4j, JavaFMI, Maestro, fmi-sim, VDMCheck
	@sh scripts/interop.sh

clean: ## remove build results
	@rm -rf build out

distclean: clean ## and the Python environment and SUNDIALS
	@rm -rf .venv .sundials

help: ## this list
	@sed -n 's/^\([a-z0-9-]*\):.*## /\1\t/p' Makefile
