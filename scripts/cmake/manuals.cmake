# Manual pages and the completion, from the program's own declarations: what --help prints.
#   cmake -DPROGRAM="…;…" -DOUT=… -P manuals.cmake        PROGRAM: with the emulator before it where it is a foreign one
# OUT/man1/vergence.1.gz, one page a command, and OUT/completions/vergence.
function(ask out)
  execute_process(COMMAND ${PROGRAM} ${ARGN} OUTPUT_VARIABLE text ERROR_VARIABLE error RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${PROGRAM} ${ARGN}: ${result} ${error}")
  endif()
  set(${out} "${text}" PARENT_SCOPE)
endfunction()

function(keep page text)
  file(WRITE ${OUT}/man1/${page}.1 "${text}")
  execute_process(COMMAND gzip -9 -n -f ${OUT}/man1/${page}.1 COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${OUT}/man1 ${OUT}/completions)
ask(page manual)
keep(vergence "${page}")
string(REGEX MATCHALL "vergence\\\\-[a-z]+\\(1\\)" commands "${page}")
foreach(command IN LISTS commands)
  string(REGEX REPLACE "vergence\\\\-([a-z]+)\\(1\\)" "\\1" word "${command}")
  ask(page manual ${word})
  keep(vergence-${word} "${page}")
endforeach()
ask(completion completion)
file(WRITE ${OUT}/completions/vergence "${completion}")
