# Man pages from --help, by help2man:
#   cmake -DPROGRAM="…;…" -DVERSION=… -DOUT=… -P manuals.cmake      PROGRAM: with the emulator before it where it is a foreign one
# OUT/man1/vergence.1.gz, vergence-COMMAND.1.gz and vergence-COMMAND-SUBCOMMAND.1.gz; none where help2man is not installed.
file(REMOVE_RECURSE ${OUT}/man1)
find_program(HELP2MAN help2man)
if(NOT HELP2MAN)
  message(STATUS "no man pages: help2man is not installed")
  return()
endif()
file(MAKE_DIRECTORY ${OUT}/man1)
list(JOIN PROGRAM " " program)

# Of the program, or of one of its commands.
function(page name description command)
  execute_process(COMMAND ${HELP2MAN} --no-info --locale=C.UTF-8 --version-string=${VERSION} --source=vergence "--name=${description}"
    "${command}" OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX REPLACE "(\n\\.SH NAME\n)[^\n]* (\\\\- )" "\\1${name} \\2" text "${text}")  # `vergence run` is no name for whatis
  file(WRITE ${OUT}/man1/${name}.1 "${text}")
  execute_process(COMMAND gzip -9 -n -f ${OUT}/man1/${name}.1 COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# Pages of the subcommands that the help of a command, or of the program, lists, and of theirs.
function(pages name command)
  execute_process(COMMAND ${command} --help OUTPUT_VARIABLE help COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE ";" "," help "${help}")  # a list of CMake is split there
  if(NOT help MATCHES "\nSubcommands:")
    return()
  endif()
  string(REGEX REPLACE ".*\nSubcommands:" "" commands "${help}")
  string(REGEX MATCHALL "\n  [a-z]+ +[^\n]+" commands "${commands}")
  foreach(line IN LISTS commands)
    string(REGEX MATCH "^\n  ([a-z]+) +(.*)$" matched "${line}")
    set(word ${CMAKE_MATCH_1})
    list(JOIN command " " joined)
    page(${name}-${word} "${CMAKE_MATCH_2}" "${joined} ${word}")
    pages(${name}-${word} "${command};${word}")
  endforeach()
endfunction()

string(REPLACE " " ";" words "${program}")
page(vergence "stereo visual odometry that finds and keeps its own calibration" "${program}")
pages(vergence "${words}")
