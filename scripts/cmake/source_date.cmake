# Sets the environment's SOURCE_DATE_EPOCH, which cpack gives to every file, unless whoever builds has: the date of the commit, or
# of an unpacked release the date of its change log.
if(NOT DEFINED ENV{SOURCE_DATE_EPOCH})
  set(source ${CMAKE_CURRENT_LIST_DIR}/../..)
  execute_process(COMMAND git -C ${source} log -1 --format=%ct OUTPUT_VARIABLE epoch ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT EXISTS ${source}/.git OR NOT epoch MATCHES "^[0-9]+$")
    file(TIMESTAMP ${source}/CHANGELOG.md epoch "%s" UTC)
  endif()
  set(ENV{SOURCE_DATE_EPOCH} ${epoch})
endif()
