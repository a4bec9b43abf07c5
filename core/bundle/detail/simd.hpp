// Included before <hwy/foreach_target.h>: SSSE3 adds only instructions that are not used here.
#ifndef HWY_DISABLED_TARGETS
#define HWY_DISABLED_TARGETS HWY_SSSE3
#endif
