// Included before <hwy/foreach_target.h>: the targets that the kernels are built for. Left out are
// those whose vectors are no C++ objects (SVE: arrays of them do not exist; such machines run NEON)
// and those that differ from a neighbour only in instructions that are not used here.
#ifndef HWY_DISABLED_TARGETS
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_SSSE3)
#endif
