// What the desk needs of OpenGL or of Direct3D 11: desk_gl.cpp and desk_d3d11.cpp. The verbs of a scene are the same.
#pragma once
#include <cstdio>
#include <string>

#include "tools.h"
#ifdef AVATAR_DESK_D3D11
#include "../d3d11/avatar_d3d11.h"
using AvatarScene = AvatarD3d11;
#define VERB(name) avatar_d3d11_##name
#else
#include "../gles/avatar_gles.h"
using AvatarScene = AvatarGles;
#define VERB(name) avatar_gles_##name
#endif

/// A context, or a device, that draws images of that size. NULL, or what is missing. `kind`: es, gl, d3d11.
const char* open_screen(const std::string& kind, int width, int height);
void close_screen();
/// Waits for the GPU.
void finish_screen();
/// Changes what scenes find that are opened from now on: OpenGL lacks an extension of that name, Direct3D 11 has its
/// kernels of the HLSL files of that folder. "": as they were.
void alter_screen(const std::string& name);

AvatarScene* open_scene(const AvatarAllocator& allocator);
int restore_scene(AvatarScene* scene);
/// Draws behind depths of float32, first row on top.
int draw_behind(AvatarScene* scene, const AvatarCamera& camera, const float* depths, int reversed);
/// Puts the image onto what the screen shows.
int show_scene(AvatarScene* scene);
/// Puts the image onto a target of bytes that was grey and has some samples a pixel, and reads that: first row on top.
int composite_scene(AvatarScene* scene, const AvatarCamera& camera, const float* background, int linear, int samples, Bytes& into);
/// Pages of memory that this process holds, and the seconds of all its threads.
long resident_pages();
double cpu_seconds();

/// A row: prints what was not refused, or refused without its words.
void row(const char* what, bool good, const char* line, const char* words);
/// Prints what a scene that has drawn nothing makes of calls that come too early.
void refused_early(AvatarScene* scene);
/// Prints a row for each call that must be refused. `instance` of `pack` is in the scene; `other` is another pack.
void refused_arguments(AvatarScene* scene, const AvatarCamera& camera, const AvatarPack* pack, AvatarInstance* instance, const AvatarPack* other);
/// The rows of depths and of targets to draw to, and of a scene that cannot be used, with the words that it says.
void refused_views(AvatarScene* scene, const AvatarCamera& camera);
void refused_all(AvatarScene* unusable, const char* words);
void refused_scenes();
