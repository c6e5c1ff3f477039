# The plugin contract: the headers that a protocol is built with, and their hash, which is part of the tag of every module
# (entry.h.in). The source tree and the installed package (packaging/dev) both use this file.

# Returns the names of these headers, relative to the folder `root` that contains the modules.
function(baudgate_contract_headers root headers)
  set(folders gateway/base config/model protocols protocols/common)
  set(again CONFIGURE_DEPENDS)  # CMake runs again when a header is added or removed
  if(CMAKE_SCRIPT_MODE_FILE)
    set(again "")
  endif()
  set(all "")
  foreach(folder IN LISTS folders)
    file(GLOB found RELATIVE ${root} ${again} ${root}/${folder}/*.h)
    if(NOT found)
      message(FATAL_ERROR "there are no headers in ${root}/${folder}")
    endif()
    list(APPEND all ${found})
  endforeach()
  list(REMOVE_ITEM all protocols/all_protocols.h)  # for tests: no protocol includes it
  list(SORT all)
  set(${headers} ${all} PARENT_SCOPE)
endfunction()

# Returns the SHA-256 of their names and contents. The place of `root` does not matter.
function(baudgate_contract_hash root hash)
  baudgate_contract_headers(${root} headers)
  set(all "")
  foreach(header IN LISTS headers)
    file(SHA256 ${root}/${header} content)
    string(APPEND all "${header} ${content}\n")
    if(NOT CMAKE_SCRIPT_MODE_FILE)
      set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${root}/${header})
    endif()
  endforeach()
  string(SHA256 all "${all}")
  set(${hash} ${all} PARENT_SCOPE)
endfunction()
