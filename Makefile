# The two commands:  make demo  and  make test.   make help  lists the rest.
# Sources are found by wildcard: a new example, test or header needs no edit here.
#   examples/*.c -> build/*                 examples/common/*.c, *.cpp -> build/libexamples.a
#   tests/test_*.c -> build/tests/test_*    tests/common/*.c, *.cpp    -> build/libtests.a
#   tests/chart/*.c   -> build/libchart.a    tests/chart/measure/*.c -> build/tests/chart/measure
#   tests/chart/mertens/*.c -> build/tests/chart/mertens    tests/chart/hao/*.c -> build/tests/chart/hao
#   tests/chart/truth/*.c -> build/tests/chart/truth    tests/chart/choice/*.c -> build/tests/chart/choice
#   tests/stability/X/*.c with tests/stability/*.c -> build/tests/stability/X
#   tests/**/test_*.sh run as they are;     make test-NAME runs one of either kind

B        := build
WARNINGS := -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror
CFLAGS   ?= -O2
CXXFLAGS ?= -O2
C_ALL     = -std=c99 $(WARNINGS) $(CFLAGS) $(LEVEL) -I. -MMD -MP
# C++ is there only for tinygltf, whose own header is not held to our warnings (a system header).
CXX_ALL   = -std=c++17 $(WARNINGS) $(CXXFLAGS) -I. -MMD -MP
LIBRARIES = -Wl,--as-needed -ltinygltf -lembree3 -lglfw -lOSMesa -lcmocka -lpthread -ldl -lm $(LDLIBS)

EXAMPLES        := $(patsubst examples/%.c,$(B)/%,$(wildcard examples/*.c))
TESTS           := $(patsubst tests/%.c,$(B)/tests/%,$(wildcard tests/test_*.c))
CHART           := $(B)/tests/chart/measure
MERTENS         := $(B)/tests/chart/mertens
STABILITY       := $(patsubst tests/stability/%/,$(B)/tests/stability/%,$(wildcard tests/stability/*/))
CHART_HAO       := $(B)/tests/chart/hao
TRUTH           := $(B)/tests/chart/truth
CHOICE          := $(B)/tests/chart/choice
EXAMPLE_OBJECTS := $(patsubst %,$(B)/obj/%.o,$(wildcard examples/common/*.c examples/common/*.cpp))
TEST_OBJECTS    := $(patsubst %,$(B)/obj/%.o,$(wildcard tests/common/*.c tests/common/*.cpp))
LIBCHART_OBJECTS := $(patsubst %,$(B)/obj/%.o,$(wildcard tests/chart/*.c))
CHART_OBJECTS   := $(patsubst %,$(B)/obj/%.o,$(wildcard tests/chart/measure/*.c))
MERTENS_OBJECTS   := $(patsubst %,$(B)/obj/%.o,$(wildcard tests/chart/mertens/*.c))
STABILITY_OBJECTS := $(patsubst %,$(B)/obj/%.o,$(wildcard tests/stability/*.c))
CHOICE_OBJECTS        := $(patsubst %,$(B)/obj/%.o,$(wildcard tests/chart/choice/*.c))
CHART_HAO_OBJECTS     := $(patsubst %,$(B)/obj/%.o,$(wildcard tests/chart/hao/*.c))
TRUTH_OBJECTS         := $(patsubst %,$(B)/obj/%.o,$(wildcard tests/chart/truth/*.c))
SCRIPTS         := $(wildcard tests/test_*.sh tests/*/test_*.sh)
TEST_NAMES      := $(sort $(patsubst $(B)/tests/test_%,%,$(TESTS)) $(patsubst test_%.sh,%,$(notdir $(SCRIPTS))))
BUNNY           := $(B)/models/bunny.glb
DRAGON          := $(B)/models/dragon.ply

.DELETE_ON_ERROR:
.SECONDARY:
.PHONY: all help demo demo-run test test-run setup chart truth figures mertens stability sync clean \
        $(addprefix test-,$(TEST_NAMES))

all: $(EXAMPLES) $(TESTS) $(CHART) $(MERTENS) $(STABILITY) $(CHART_HAO) $(TRUTH) $(CHOICE)

help:
	@echo "make            builds the examples ($(notdir $(EXAMPLES))) and the tests into $(B)/"
	@echo "make demo       sets up, builds, bakes the bunny in four materials and sizes, draws what deforms, the"
	@echo "                bunny's atlases and the light round it: examples/pictures/gallery, bem, atlas, hao.png"
	@echo "make test       sets up, builds, runs every test; ends with the line 'N passed, N failed'"
	@echo "make test-NAME  runs one test:$(addprefix $() ,$(TEST_NAMES))"
	@echo "make chart      measures speed against accuracy, and atlases, anew: tests/chart/chart.csv, .svg, .md"
	@echo "                CASE='bunny-*' METHOD=hao, patterns both, measures part of it anew"
	@echo "make truth      random walks for the chart's cases whose files are out of date: tests/chart/truth/"
	@echo "make figures    draws every figure and writes every table again from the files that the others left"
	@echo "make mertens    repeats the experiments of Mertens et al. 2003: tests/chart/mertens/README.md"
	@echo "make stability  sweeps what breaks each method: tests/stability/README.md, and figures in its folders"
	@echo "make sync       copies the common block of sss_dipole.h into the other headers"
	@echo "make setup      installs the Debian packages that all of this needs"
	@echo "make clean      removes $(B)/"
	@echo "CC, CXX, CFLAGS, CXXFLAGS, LDFLAGS and LDLIBS are heeded."

setup:
	sh tests/setup.sh test

# Set-up first, then a second make that sees what it brought, on all processors unless told otherwise.
JOBS = $(if $(filter -j%,$(MAKEFLAGS)),,-j$(shell nproc))

demo:
	@sh tests/setup.sh demo
	@$(MAKE) --no-print-directory $(JOBS) demo-run

demo-run: $(EXAMPLES) $(BUNNY)
	sh examples/gallery.sh
	@echo "The pictures are in $(CURDIR)/examples/pictures"

test:
	@sh tests/setup.sh test
	@$(MAKE) --no-print-directory $(JOBS) test-run

test-run: all $(BUNNY) $(DRAGON)
	@sh tests/run.sh $(TESTS) $(SCRIPTS)

define one_test
test-$(patsubst test_%,%,$(basename $(notdir $(1)))): all $(BUNNY) $(DRAGON)
	@sh tests/run.sh $(1)
endef
$(foreach test,$(TESTS) $(SCRIPTS),$(eval $(call one_test,$(test))))

chart:
	@sh tests/setup.sh test
	@$(MAKE) --no-print-directory $(JOBS) all $(BUNNY) $(DRAGON)
	CASE='$(CASE)' METHOD='$(METHOD)' sh tests/chart/chart.sh
	$(if $(CASE)$(METHOD),,sh tests/chart/atlas.sh)
	$(if $(CASE)$(METHOD),,sh tests/chart/examples.sh)

truth:
	@sh tests/setup.sh test
	@$(MAKE) --no-print-directory $(JOBS) all $(BUNNY) $(DRAGON)
	sh tests/chart/truth/truth.sh

figures:
	@sh tests/setup.sh test
	@$(MAKE) --no-print-directory $(JOBS) all $(BUNNY) $(DRAGON)
	sh tests/figures.sh

mertens:
	@sh tests/setup.sh test
	@$(MAKE) --no-print-directory $(JOBS) all
	sh tests/chart/mertens/mertens.sh

stability:
	@sh tests/setup.sh test
	@$(MAKE) --no-print-directory $(JOBS) all
	sh tests/stability/stability.sh

# Only the lines between the two markers are replaced, those included.
sync:
	sh tests/compile/sync.sh

clean:
	rm -rf $(B)

# ---- files ----

# Says which packages to install before a compiler stumbles over a missing header.
$(B)/.setup: tests/setup.sh
	@mkdir -p $(@D)
	@sh tests/setup.sh --check build
	@touch $@

$(B)/obj/%.c.o: %.c | $(B)/.setup
	@mkdir -p $(@D)
	$(CC) $(C_ALL) -c $< -o $@

# Three implementations, for tests that run for a moment.
$(B)/obj/tests/test_include.c.o: LEVEL = -O0

$(B)/obj/%.cpp.o: %.cpp | $(B)/.setup
	@mkdir -p $(@D)
	$(CXX) $(CXX_ALL) -c $< -o $@

# Made anew each time, so that an object whose source is gone does not stay inside.
$(B)/libexamples.a: $(EXAMPLE_OBJECTS)
	rm -f $@ && $(AR) rcs $@ $^

$(B)/libtests.a: $(TEST_OBJECTS)
	rm -f $@ && $(AR) rcs $@ $^

# Measuring for the chart, for the program that does it and for bake --chart.
$(B)/libchart.a: $(LIBCHART_OBJECTS)
	rm -f $@ && $(AR) rcs $@ $^

# The linker is the C++ one because tinygltf is C++. Examples may measure themselves against tests/common's reference.
$(EXAMPLES): $(B)/%: $(B)/obj/examples/%.c.o $(B)/libchart.a $(B)/libexamples.a $(B)/libtests.a
	$(CXX) $(LDFLAGS) $^ $(LIBRARIES) -o $@

$(TESTS): $(B)/tests/%: $(B)/obj/tests/%.c.o $(B)/libexamples.a $(B)/libtests.a
	@mkdir -p $(@D)
	$(CXX) $(LDFLAGS) $^ $(LIBRARIES) -o $@

# One program from all the sources of a folder. The libraries follow the objects that need them.
$(CHART): $(CHART_OBJECTS)
$(MERTENS): $(MERTENS_OBJECTS)
define of_stability
$(B)/tests/stability/$(1): $(patsubst %,$(B)/obj/%.o,$(wildcard tests/stability/$(1)/*.c)) $(STABILITY_OBJECTS)
endef
$(foreach folder,$(notdir $(STABILITY)),$(eval $(call of_stability,$(folder))))
$(CHART_HAO): $(CHART_HAO_OBJECTS)
$(TRUTH): $(TRUTH_OBJECTS)
$(CHOICE): $(CHOICE_OBJECTS)
$(CHART) $(MERTENS) $(STABILITY) $(CHART_HAO) $(TRUTH) $(CHOICE): $(B)/libchart.a $(B)/libexamples.a $(B)/libtests.a
	@mkdir -p $(@D)
	$(CXX) $(LDFLAGS) $(filter %.o,$^) $(filter %.a,$^) $(LIBRARIES) -o $@

# Stanford's bunny as Debian's glmark2-data has it; -noq keeps 32-bit floats and every triangle.
$(BUNNY): tests/bunny.sh | $(B)/.setup
	@mkdir -p $(@D)
	sh tests/bunny.sh $@

# Stanford's dragon; where npm cannot fetch it, tests do without.
$(DRAGON): tests/dragon.sh | $(B)/.setup
	sh tests/dragon.sh $(@D)

-include $(shell find $(B)/obj -name '*.d' 2>/dev/null)
