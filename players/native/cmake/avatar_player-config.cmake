# find_package(avatar_player) reads this: targets avatar_player::avatar_player and avatar_player::avatar_gles.
include(${CMAKE_CURRENT_LIST_DIR}/avatar_player-targets.cmake)
