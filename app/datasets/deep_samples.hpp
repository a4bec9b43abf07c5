#pragma once
#include "app/datasets/stereo_sequence.hpp"

namespace vergence::app {

/// Cameras of 10, 12 or 14 bits are often kept in 16 bits a sample without being scaled, in PNG and
/// in bags, which looks black. Sets `deep_bits` of the sequence by the greatest sample of some
/// images of the drive, and adds a remark where that is below 16.
void find_deep_bits(StereoSequence* sequence);

}  // namespace vergence::app
