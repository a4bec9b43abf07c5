#pragma once

namespace vergence::features {

/// The instruction set that the kernels run on here, by Highway's name for it (`AVX3`, `AVX2`,
/// `SSE4`, `NEON`, `EMU128`: none, portable code): the best of those that the machine has and the
/// program is built for, chosen at run time. Any thread; a literal.
[[nodiscard]] const char* simd_target() noexcept;

}  // namespace vergence::features
