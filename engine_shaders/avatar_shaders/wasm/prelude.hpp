// What the C++ that Slang's compiler writes of a compute entry expects to be there, and no more of it.
// Buffers are not checked: the player checks every pass against the access contract of its entry.
#include <stddef.h>
#include <stdint.h>

#define INLINE [[clang::always_inline]] // so that a loop over rows keeps constants in registers

template <typename T, int N>
struct Vector;

template <typename T>
struct Vector<T, 2>
{
    T x, y;
    Vector() = default;
    Vector(T all) : x(all), y(all) {}
    Vector(T x, T y) : x(x), y(y) {}
    T& operator[](int index) { return (&x)[index]; }
};

template <typename T>
struct Vector<T, 3>
{
    T x, y, z;
    Vector() = default;
    Vector(T all) : x(all), y(all), z(all) {}
    Vector(T x, T y, T z) : x(x), y(y), z(z) {}
    T& operator[](int index) { return (&x)[index]; }
};

template <typename T>
struct Vector<T, 4>
{
    T x, y, z, w;
    Vector() = default;
    Vector(T all) : x(all), y(all), z(all), w(all) {}
    Vector(T x, T y, T z, T w) : x(x), y(y), z(z), w(w) {}
    T& operator[](int index) { return (&x)[index]; }
};

#define AVATAR_OPERATOR(op) \
    template <typename T> \
    static inline Vector<T, 2> operator op(Vector<T, 2> a, Vector<T, 2> b) \
    { \
        return {a.x op b.x, a.y op b.y}; \
    } \
    template <typename T> \
    static inline Vector<T, 3> operator op(Vector<T, 3> a, Vector<T, 3> b) \
    { \
        return {a.x op b.x, a.y op b.y, a.z op b.z}; \
    } \
    template <typename T> \
    static inline Vector<T, 4> operator op(Vector<T, 4> a, Vector<T, 4> b) \
    { \
        return {a.x op b.x, a.y op b.y, a.z op b.z, a.w op b.w}; \
    }
AVATAR_OPERATOR(+)
AVATAR_OPERATOR(-)
AVATAR_OPERATOR(*)
AVATAR_OPERATOR(/)

template <typename T>
static inline Vector<T, 2> operator-(Vector<T, 2> a)
{
    return {-a.x, -a.y};
}

template <typename T>
static inline Vector<T, 3> operator-(Vector<T, 3> a)
{
    return {-a.x, -a.y, -a.z};
}

template <typename T>
static inline Vector<T, 4> operator-(Vector<T, 4> a)
{
    return {-a.x, -a.y, -a.z, -a.w};
}

template <typename T, int N>
static inline T _slang_vector_get_element(Vector<T, N> vector, int index)
{
    return vector[index];
}

template <typename T>
struct StructuredBuffer
{
    const T* elements;
    T Load(uint32_t index) const { return elements[index]; }
};

template <typename T>
struct RWStructuredBuffer
{
    T* elements;
    T Load(uint32_t index) const { return elements[index]; }
    T& operator[](uint32_t index) const { return elements[index]; }
};

struct ComputeThreadVaryingInput
{
    Vector<uint32_t, 3> groupID, groupThreadID;
};

template <typename T, typename S>
static inline T slang_bit_cast(S value)
{
    return static_cast<T>(value);
}

extern "C" float expf(float);
extern "C" float logf(float);
static inline float F32_exp(float x) { return expf(x); }
static inline float F32_log(float x) { return logf(x); }
static inline float F32_sqrt(float x) { return __builtin_sqrtf(x); }
static inline float F32_abs(float x) { return __builtin_fabsf(x); }
static inline float F32_ceil(float x) { return __builtin_ceilf(x); }
static inline float F32_floor(float x) { return __builtin_floorf(x); }
static inline float F32_trunc(float x) { return __builtin_truncf(x); }
static inline float F32_min(float a, float b) { return b < a ? b : a; }
static inline float F32_max(float a, float b) { return a < b ? b : a; }
static inline uint32_t U32_min(uint32_t a, uint32_t b) { return b < a ? b : a; }
static inline uint32_t F32_asuint(float x) { return __builtin_bit_cast(uint32_t, x); }
static inline float U32_asfloat(uint32_t x) { return __builtin_bit_cast(float, x); }
