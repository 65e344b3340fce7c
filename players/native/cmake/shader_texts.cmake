# The texts of the shaders as rows of C++, for src/c_interface/shader_texts.cpp. For a build without CMake:
#   cmake -D TO=FOLDER -P shader_texts.cmake    and FOLDER is an include folder of the build
# A source archive has the texts in shaders/, a checkout in engine_shaders/.
foreach(folder ../shaders ../../../engine_shaders/avatar_shaders)
  get_filename_component(AVATAR_SHADERS ${CMAKE_CURRENT_LIST_DIR}/${folder} ABSOLUTE)
  if(EXISTS ${AVATAR_SHADERS}/glsl)
    break()
  endif()
endforeach()

set(AVATAR_PIECE 12000) # bytes of a literal; MSVC takes 16,380
set(AVATAR_MOST 65000)  # bytes of the literals of a text, joined; MSVC takes 65,535

# A text as a literal of C++, in pieces.
function(avatar_literal FILE TEXT OUT)
  string(LENGTH "${TEXT}" length)
  string(FIND "${TEXT}" ")~\"" end)
  if(length GREATER AVATAR_MOST OR NOT end EQUAL -1)
    message(FATAL_ERROR "avatar_player: ${FILE} is longer than ${AVATAR_MOST} bytes, or )~\" is in it: some compilers "
      "would refuse it as a string")
  endif()
  set(literal "")
  set(at 0)
  while(at LESS length)
    string(SUBSTRING "${TEXT}" ${at} ${AVATAR_PIECE} piece)
    string(APPEND literal "R\"~(${piece})~\"\n")
    math(EXPR at "${at} + ${AVATAR_PIECE}")
  endwhile()
  set(${OUT} "${literal}" PARENT_SCOPE)
endfunction()

function(avatar_write_changed PATH TEXT)
  set(old "")
  if(EXISTS ${PATH})
    file(READ ${PATH} old)
  endif()
  if(NOT old STREQUAL TEXT)
    file(WRITE ${PATH} "${TEXT}")
  endif()
endfunction()

# Writes avatar_hlsl_texts.inc for d3d11/compiler.cpp: each file of HLSL by its name, since they include each other.
function(avatar_write_hlsl_texts FOLDER OUT)
  file(GLOB files ${ARGN} ${AVATAR_SHADERS}/hlsl/*.hlsl ${AVATAR_SHADERS}/hlsl/*.hlsli)
  if(NOT files)
    message(FATAL_ERROR "avatar_player: ${AVATAR_SHADERS}/hlsl has no shader texts: take the whole source archive, or the "
      "whole repository")
  endif()
  set(rows "")
  foreach(file ${files})
    get_filename_component(name ${file} NAME)
    file(READ ${file} text)
    avatar_literal("${file}" "${text}" literal)
    string(APPEND rows "{\"${name}\",\n${literal}},\n")
  endforeach()
  avatar_write_changed(${FOLDER}/avatar_hlsl_texts.inc "${rows}")
  set(${OUT} ${files} PARENT_SCOPE)
endfunction()

# Writes avatar_shader_texts.inc into a folder, unless it is there as it would be. OUT: the files of which it is made.
# CONFIGURE_DEPENDS may follow, but not in a script.
function(avatar_write_shader_texts FOLDER OUT)
  set(rows "")
  set(all "")
  foreach(language glsl430 glsl310es msl)
    string(REGEX REPLACE "^glsl.*" "glsl" below ${language})
    file(GLOB files ${ARGN} ${AVATAR_SHADERS}/${below}/*)
    if(NOT files)
      message(FATAL_ERROR "avatar_player: ${AVATAR_SHADERS}/${below} has no shader texts: take the whole source "
        "archive, or the whole repository")
    endif()
    list(APPEND all ${files})
    string(TOUPPER "AVATAR_${language}" number)
    foreach(file ${files})
      get_filename_component(entry ${file} NAME_WE)
      file(READ ${file} text)
      if(language STREQUAL glsl430)
        string(REPLACE "#version 310 es" "#version 430" text "${text}")
      endif()
      avatar_literal("${file}" "${text}" literal)
      string(APPEND rows "{${number}, \"${entry}\",\n${literal}},\n")
    endforeach()
  endforeach()
  avatar_write_changed(${FOLDER}/avatar_shader_texts.inc "${rows}")
  set(${OUT} ${all} PARENT_SCOPE)
endfunction()

# Gives the texts to a target that compiles src/; with the word hlsl, to one that compiles d3d11/. CMake runs again where a
# text changes or one comes.
function(avatar_add_shader_texts TARGET)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/shader_texts)
  if("hlsl" IN_LIST ARGN)
    avatar_write_hlsl_texts(${folder} files CONFIGURE_DEPENDS)
  else()
    avatar_write_shader_texts(${folder} files CONFIGURE_DEPENDS)
  endif()
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${files})
  target_include_directories(${TARGET} PRIVATE ${folder})
endfunction()

if(CMAKE_SCRIPT_MODE_FILE STREQUAL CMAKE_CURRENT_LIST_FILE)
  if(NOT TO)
    message(FATAL_ERROR "cmake -D TO=FOLDER -P shader_texts.cmake: TO is missing")
  endif()
  avatar_write_shader_texts(${TO} files)
  avatar_write_hlsl_texts(${TO} files)
endif()
