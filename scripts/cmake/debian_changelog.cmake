# OUT/changelog.gz in Debian's form, one entry: package, version, contact and out are set by whoever includes this.
include(${CMAKE_CURRENT_LIST_DIR}/source_date.cmake)
execute_process(COMMAND date -u -R -d @$ENV{SOURCE_DATE_EPOCH} OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE
  COMMAND_ERROR_IS_FATAL ANY)
file(WRITE ${out}/changelog "${package} (${version}) bookworm; urgency=medium

  * /usr/share/doc/vergence/CHANGELOG.md says what changed.

 -- ${contact}  ${date}
")
execute_process(COMMAND gzip -9 -n -f ${out}/changelog COMMAND_ERROR_IS_FATAL ANY)
