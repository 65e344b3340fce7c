// Macros for what differs between engines.
// Reads: nothing. Writes: nothing.
//
// Constants are in a cbuffer. Where the engine gathers them by name, define AVATAR_LOOSE_CONSTANTS: they are then
// global variables.
#ifndef AVATAR_PLATFORM_HLSLI
#define AVATAR_PLATFORM_HLSLI

#ifdef AVATAR_LOOSE_CONSTANTS
#define AVATAR_CONSTANTS(name)
#define AVATAR_CONSTANTS_END
#else
#define AVATAR_CONSTANTS(name) cbuffer name {
#define AVATAR_CONSTANTS_END };
#endif

#define AVATAR_THREADS 64

#endif
