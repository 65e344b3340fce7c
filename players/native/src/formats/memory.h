#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "../../include/avatar_player.h"
#include "text.h"

namespace avatar {

/// The allocator that a caller gave, or malloc's. Its functions are null where what was given cannot be used.
AvatarAllocator allocator_or_default(const AvatarAllocator* given);

/// Elements that somebody else holds.
template <class T>
struct Span {
    T* data = nullptr;
    size_t size = 0;

    T& operator[](size_t i) const { return data[i]; }
    T* begin() const { return data; }
    T* end() const { return data + size; }
    bool empty() const { return size == 0; }
};

/// Takes memory in blocks and gives all of it back at once. What lies in it has no destructor. Where no memory is given
/// it sets the error and returns an empty span: every caller checks its errors before it uses elements.
class Arena {
public:
    Arena(const AvatarAllocator& allocator, Errors& errors) : allocator_(allocator), errors_(errors) {}
    ~Arena();
    Arena(const Arena&) = delete;
    Arena& operator=(const Arena&) = delete;

    /// Memory for `bytes` bytes of any type; null where there is none.
    void* take(size_t bytes);

    /// Elements that the caller sets.
    template <class T>
    Span<T> make_unset(size_t count) {
        if (count > most_bytes / sizeof(T)) {
            errors_.set_memory();
            return {};
        }
        T* data = static_cast<T*>(take(count * sizeof(T)));
        return data == nullptr ? Span<T>{} : Span<T>{data, count};
    }

    /// Zeroed elements.
    template <class T>
    Span<T> make(size_t count) {
        Span<T> made = make_unset<T>(count);
        if (made.size > 0) std::memset(static_cast<void*>(made.data), 0, made.size * sizeof(T));
        return made;
    }

    /// Copied elements.
    template <class T>
    Span<T> copy(const T* data, size_t count) {
        Span<T> made = make_unset<T>(count);
        if (made.size > 0) std::memcpy(static_cast<void*>(made.data), data, count * sizeof(T));
        return made;
    }

    /// A copied text with a zero behind it.
    Text copy(Text text);

    const AvatarAllocator& allocator() const { return allocator_; }
    Errors& errors() const { return errors_; }

private:
    static constexpr size_t most_bytes = static_cast<size_t>(1) << (sizeof(size_t) * 8 - 2);

    struct Block {
        Block* before;
        size_t bytes;
    };

    char* grow(size_t bytes);

    AvatarAllocator allocator_;
    Errors& errors_;
    Block* newest_ = nullptr;
    char* next_ = nullptr;
    size_t left_ = 0;
    size_t block_bytes_ = 4096;
};

/// Plain elements in one run of memory that may grow.
template <class T>
class Grown {
public:
    Grown(const AvatarAllocator& allocator, Errors& errors) : allocator_(allocator), errors_(errors) {}
    ~Grown() { release(); }
    Grown(const Grown&) = delete;
    Grown& operator=(const Grown&) = delete;

    T* data() const { return data_; }
    size_t size() const { return size_; }
    size_t capacity() const { return capacity_; }
    T& operator[](size_t i) const { return data_[i]; }
    void set_size(size_t size) { size_ = size; }

    /// Makes room for `count` elements. Returns false, and sets the error, where there is no memory.
    bool reserve(size_t count) {
        if (count <= capacity_) return true;
        if (count > SIZE_MAX / 4 / sizeof(T)) return fail();
        const size_t wanted = count > 2 * capacity_ ? count : 2 * capacity_;
        T* made = static_cast<T*>(allocator_.allocate(allocator_.user, wanted * sizeof(T)));
        if (made == nullptr) return fail();
        const size_t size = size_;
        if (size > 0) std::memcpy(static_cast<void*>(made), data_, size * sizeof(T));
        release();
        data_ = made;
        size_ = size;
        capacity_ = wanted;
        return true;
    }

    bool add(const T& one) {
        if (size_ == capacity_ && !reserve(size_ + 16)) return false;
        data_[size_++] = one;
        return true;
    }

    void release() {
        if (data_ != nullptr) allocator_.release(allocator_.user, data_, capacity_ * sizeof(T));
        data_ = nullptr;
        size_ = capacity_ = 0;
    }

private:
    bool fail() {
        errors_.set_memory();
        return false;
    }

    AvatarAllocator allocator_;
    Errors& errors_;
    T* data_ = nullptr;
    size_t size_ = 0;
    size_t capacity_ = 0;
};

/// Numbers by name. Its hashes differ from run to run, so that no file can make them collide.
class Names {
public:
    static constexpr int64_t none = -1;

    /// Room for `most` names.
    bool make(Arena& arena, size_t most);

    /// False: the name is there already, and keeps its number.
    bool add(Text name, uint32_t number);

    /// The number of a name, or none.
    int64_t find(Text name) const;

    /// The same, as a place that may be changed; null where there is none.
    uint32_t* place(Text name) const;

private:
    struct Slot {
        Text name;
        uint32_t number;
        bool used;
    };

    Slot* slot(Text name) const;

    Span<Slot> slots_;
};

/// Of bytes, seeded by the run.
uint32_t hash_of(Text name);

}  // namespace avatar
