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

#define AVATAR_THREADS 64 // threads of a group

// A texture that is read with all 32 bits of its floats. Define it before where an engine reads fewer by default.
#ifndef AVATAR_FLOAT_TEXTURE
#define AVATAR_FLOAT_TEXTURE(name) Texture2D<float4> name
#endif

// Counters in group memory, which several threads of a group change at a time. WGSL has a type of its own for them: for
// Slang's compiler to WGSL define AVATAR_ATOMIC_COUNTERS.
#ifdef AVATAR_ATOMIC_COUNTERS
#define AVATAR_GROUP_COUNTERS(name, size) groupshared Atomic<uint> name[size]
#define AVATAR_COUNTER(counter) counter.load()
#define AVATAR_COUNTER_CLEAR(counter) counter.store(0)
#define AVATAR_COUNTER_INCREMENT(counter) counter.increment()
#else
#define AVATAR_GROUP_COUNTERS(name, size) groupshared uint name[size]
#define AVATAR_COUNTER(counter) counter
#define AVATAR_COUNTER_CLEAR(counter) counter = 0
#define AVATAR_COUNTER_INCREMENT(counter) InterlockedAdd(counter, 1)
#endif

// A buffer of numbers that several threads make smaller at a time; under AVATAR_ONE_THREAD only one does.
#if defined(AVATAR_ONE_THREAD)
#define AVATAR_LEAST_BUFFER(name) RWStructuredBuffer<uint> name
#define AVATAR_LEAST_CLEAR(name, at, value) name[at] = value
#define AVATAR_LEAST(name, at, value) name[at] = min(name[at], value)
#elif defined(AVATAR_ATOMIC_COUNTERS)
#define AVATAR_LEAST_BUFFER(name) RWStructuredBuffer<Atomic<uint>> name
#define AVATAR_LEAST_CLEAR(name, at, value) name[at].store(value)
#define AVATAR_LEAST(name, at, value) name[at].min(value)
#else
#define AVATAR_LEAST_BUFFER(name) RWStructuredBuffer<uint> name
#define AVATAR_LEAST_CLEAR(name, at, value) name[at] = value
#define AVATAR_LEAST(name, at, value) InterlockedMin(name[at], value)
#endif

#endif
