#pragma once

namespace vergence::features {

/// Instruction set of the kernels by Highway's name (`AVX3`, `AVX2`, `SSE4`, `NEON`, or `EMU128`
/// for portable code): the best one of the machine and the build, selected at run time. Any thread;
/// a literal.
[[nodiscard]] const char* simd_target() noexcept;

}  // namespace vergence::features
