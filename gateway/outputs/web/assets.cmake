# Packs the files of the page (all of gateway/outputs/web/page), and builds them into the program.
# baudgate_web_assets(VARIABLE): sets VARIABLE to the sources that contain them.
function(baudgate_web_assets variable)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/assets)
  file(MAKE_DIRECTORY ${folder})
  file(GLOB_RECURSE own CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR}/page
    page/*.html page/*.css page/*.js page/*.svg page/*.png page/*.ico page/*.json page/*.webmanifest)
  list(SORT own)
  set(files "")
  foreach(file IN LISTS own)
    list(APPEND files "/${file}|${CMAKE_CURRENT_SOURCE_DIR}/page/${file}")
  endforeach()
  set(blobs "")
  set(assembly "// Made by assets.cmake.\n  .section .rodata\n")
  set(externs "")
  set(table "")
  set(number 0)
  foreach(entry IN LISTS files)
    string(REGEX REPLACE "\\|.*" "" path "${entry}")
    string(REGEX REPLACE ".*\\|" "" source "${entry}")
    set(blob ${folder}/${number}.gz)
    add_custom_command(OUTPUT ${blob} COMMAND gzip -9 -n -c ${source} > ${blob} DEPENDS ${source} VERBATIM)
    list(APPEND blobs ${blob})
    string(APPEND assembly "  .balign 16\n  .global baudgate_web_${number}_begin\n  .hidden baudgate_web_${number}_begin\n"
      "baudgate_web_${number}_begin:\n  .incbin \"${number}.gz\"\n  .global baudgate_web_${number}_end\n"
      "  .hidden baudgate_web_${number}_end\nbaudgate_web_${number}_end:\n  .byte 0\n")
    string(APPEND externs "extern const char baudgate_web_${number}_begin[];\nextern const char baudgate_web_${number}_end[];\n")
    string(APPEND table "    {\"${path}\", baudgate_web_${number}_begin, baudgate_web_${number}_end},\n")
    math(EXPR number "${number} + 1")
  endforeach()
  string(APPEND assembly "  .section .note.GNU-stack,\"\",%progbits\n")
  file(CONFIGURE OUTPUT ${folder}/assets.S CONTENT "${assembly}" @ONLY)
  file(CONFIGURE OUTPUT ${folder}/asset_table.cpp @ONLY CONTENT "// Made by assets.cmake.
#include \"gateway/outputs/web/web_server.h\"

extern \"C\" {
${externs}}

namespace baudgate::web {

std::span<const PackedFile> PackedFiles() {
  static const PackedFile kFiles[] = {
${table}  };
  return kFiles;
}

}  // namespace baudgate::web
")
  # The compiler does not report the files that .incbin reads, so they are dependencies here.
  set_source_files_properties(${folder}/assets.S PROPERTIES OBJECT_DEPENDS "${blobs}" COMPILE_OPTIONS "-I${folder}")
  set(${variable} ${folder}/assets.S ${folder}/asset_table.cpp PARENT_SCOPE)
endfunction()
