# find_package(avatar_player) reads this: targets avatar_player::avatar_player, avatar_player::avatar_gles and, on
# Windows, avatar_player::avatar_d3d11.
include(${CMAKE_CURRENT_LIST_DIR}/avatar_player-targets.cmake)
