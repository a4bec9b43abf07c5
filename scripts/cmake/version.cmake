# Writes the .cpp file behind app/runtime/version.hpp. Runs at every build, so that the commit is the one that was built;
# leaves an unchanged file alone, so that nothing is compiled again. Without git, or outside a checkout: the bare version.
#   cmake -DSOURCE=… -DVERSION=… -DOUT=… -P version.cmake
set(text "${VERSION}")
if(EXISTS "${SOURCE}/.git") # not the repository that an unpacked release happens to lie in
  find_program(git git)
  if(git)
    execute_process(COMMAND ${git} -C ${SOURCE} describe --always --abbrev=7 --exclude=* --dirty=+
      OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
    if(NOT failed AND commit MATCHES "^[0-9a-f]+[+]?$")
      set(text "${VERSION} (${commit})")
    endif()
  endif()
endif()
file(CONFIGURE OUTPUT ${OUT} @ONLY CONTENT [[
#include "app/runtime/version.hpp"

namespace vergence::app {
std::string_view version() noexcept { return "@text@"; }
}  // namespace vergence::app
]])
