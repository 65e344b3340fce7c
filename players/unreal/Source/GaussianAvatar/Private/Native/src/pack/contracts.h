// Copy of players/native/src/pack/contracts.h by `python -m avatar_shaders`; do not edit.
#pragma once
#include <cstdint>

#include "../formats/text.h"

namespace avatar {

/// The type of a constant: its number is that of the header's AVATAR_UINT .. AVATAR_FLOAT4, and of a float its floats.
enum class ConstantType : uint8_t { uint, float1, float2, float3, float4 };

/// A member of a uniform block, at `offset` bytes.
struct Member {
    const char* name;
    uint32_t offset;
    ConstantType type;
};

/// A storage buffer of an entry, with elements of `stride` bytes.
struct StorageBuffer {
    const char* name;  // the shader's
    uint32_t binding;
    uint32_t stride;
    bool is_read_only;
};

/// Entries of a made table.
template <class T>
struct Table {
    const T* data;
    uint32_t size;

    const T* begin() const { return data; }
    const T* end() const { return data + size; }
};

/// What a constant may be.
struct Values {
    const char* constant;
    Table<uint32_t> values;
};

/// The largest value of a constant that is at least 1.
struct Most {
    const char* constant;
    uint32_t most;
};

/// Two names, or two expressions.
struct NamePair {
    const char* first;
    const char* second;
};

/// Constants on which all passes over a buffer agree.
struct Same {
    const char* buffer;
    Table<const char*> constants;
};

/// How many elements of a buffer without sections a pass touches, under conditions.
struct Touched {
    const char* buffer;
    const char* elements;
    Table<Values> when;
};

enum class SectionKind : uint8_t { pointer, index, linear, signed_, weight, table };

/// A section of a packed buffer, under conditions.
struct SectionContract {
    const char* name;
    const char* buffer;
    SectionKind kind;
    const char* elements;
    const char* width;  // null: 32 bits
    Table<uint32_t> widths;
    const char* below;
    uint32_t pointer;
    const char* scale;
    const char* floats;
    Table<Values> when;
};

/// What a pass of an entry reads and writes, by its constants: avatar_shaders/contracts.py explains each key.
/// Expressions are sums of products: "3*#morph_ptr+1".
struct Contract {
    const char* rows;
    Table<Most> most;
    Table<Values> values;
    Table<NamePair> fits;
    Table<NamePair> pose;  // constant, section of Pose
    Table<Same> same;
    const char* chunk;
    Table<const char*> level;
    Table<Touched> elements;
    Table<SectionContract> sections;
};

/// What a compute entry of the shaders binds.
struct Interface {
    const char* entry;
    const char* stage;
    uint32_t thread_group;
    uint32_t block_binding;
    uint32_t block_bytes;
    Table<StorageBuffer> storage;
    Table<Member> members;
    const Contract* access;  // null for an entry that no program may use
};

extern const Interface interfaces[];
extern const uint32_t interface_count;

/// The interface of an entry; null: there is none.
const Interface* interface_of(Text entry);

}  // namespace avatar
