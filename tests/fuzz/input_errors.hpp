#pragma once
#include "app/runtime/errors.hpp"

namespace vergence::test {

/// Reads something that may be refused, but in no other way than by an InputError.
template <class Read>
void probe(const Read& read) {
  try {
    read();
  } catch (const app::InputError&) {
  }
}

}  // namespace vergence::test
