// Values of the engine: a small part of what godot-cpp is for.
#pragma once
#include <initializer_list>
#include <utility>

#include "../made/engine.h"

namespace godot {

extern EngineFunctions engine;
extern GDExtensionClassLibraryPtr library;

/// Loads the functions and the conversions. False: this engine lacks one.
bool load_engine(GDExtensionInterfaceGetProcAddress get, GDExtensionClassLibraryPtr own);

struct Vector3 {
    float x, y, z;
};
struct Vector2i {
    int32_t x, y;
};
struct Transform3D {
    float rows[3][3];
    Vector3 origin;
};
struct Projection {
    float columns[4][4];
};
struct Aabb {
    Vector3 position, size;
};
/// An object of the engine's servers.
struct Rid {
    uint64_t id = 0;
};

/// A name that the engine knows; made once, kept for ever.
class Name {
public:
    Name(const char* text) { engine.string_name_new_with_latin1_chars(&data_, text, 0); }
    Name(const Name&) = delete;
    ~Name();
    const void* get() const { return &data_; }

private:
    void* data_ = nullptr;
};

/// The engine's Variant.
class Value {
public:
    Value() { engine.variant_new_nil(data_); }
    Value(bool value) {
        GDExtensionBool given = value;
        make(GDEXTENSION_VARIANT_TYPE_BOOL, &given);
    }
    Value(int64_t value) { make(GDEXTENSION_VARIANT_TYPE_INT, &value); }
    Value(int value) : Value(static_cast<int64_t>(value)) {}
    Value(uint32_t value) : Value(static_cast<int64_t>(value)) {}
    Value(double value) { make(GDEXTENSION_VARIANT_TYPE_FLOAT, &value); }
    Value(const char* utf8);
    Value(const Name& name) { make(GDEXTENSION_VARIANT_TYPE_STRING_NAME, const_cast<void*>(name.get())); }
    Value(Vector3 value) { make(GDEXTENSION_VARIANT_TYPE_VECTOR3, &value); }
    Value(Vector2i value) { make(GDEXTENSION_VARIANT_TYPE_VECTOR2I, &value); }
    Value(const Transform3D& value) { make(GDEXTENSION_VARIANT_TYPE_TRANSFORM3D, const_cast<Transform3D*>(&value)); }
    Value(Aabb value) { make(GDEXTENSION_VARIANT_TYPE_AABB, &value); }
    Value(Rid value) { make(GDEXTENSION_VARIANT_TYPE_RID, &value); }
    /// Of a new object that counts its references: this is the first.
    static Value object(GDExtensionObjectPtr object);
    /// An empty value of a type: an array, a dictionary, a packed array.
    static Value empty(GDExtensionVariantType type);
    static Value array() { return empty(GDEXTENSION_VARIANT_TYPE_ARRAY); }
    static Value dictionary() { return empty(GDEXTENSION_VARIANT_TYPE_DICTIONARY); }
    static Value bytes(size_t size, const void* content = nullptr);
    static Value floats(size_t count, const float* content = nullptr);
    /// A copy of what the engine holds: of a value, of a type.
    static Value copy(GDExtensionConstVariantPtr other);
    static Value of_pointer(GDExtensionVariantType type, GDExtensionConstTypePtr pointer);

    Value(const Value& other) { engine.variant_new_copy(data_, other.data_); }
    Value(Value&& other) noexcept {
        engine.variant_new_nil(data_);
        swap(other);
    }
    Value& operator=(Value other) noexcept {
        swap(other);
        return *this;
    }
    ~Value() { engine.variant_destroy(data_); }

    GDExtensionVariantType type() const { return engine.variant_get_type(data_); }
    bool is_nil() const { return type() == GDEXTENSION_VARIANT_TYPE_NIL; }
    int64_t to_int() const;
    double to_float() const;
    bool to_bool() const { return to_int() != 0; }
    Rid to_rid() const;
    Transform3D to_transform() const;
    GDExtensionObjectPtr to_object() const;
    /// Writes UTF-8 and a zero behind it, cut to `size`; returns the bytes that it takes without the zero.
    size_t to_utf8(char* out, size_t size) const;
    /// The elements of a packed array, and how many.
    size_t size() const;
    uint8_t* bytes_data() const;
    float* floats_data() const;
    /// What lies in it: arguments of calls by pointer.
    void* inner() const;

    /// Calls a method by its name. The slow way, for what is done once.
    Value call(const char* method, std::initializer_list<Value> given = {}) const;
    void append(const Value& value) const { call("append", {value}); }
    void set(const char* key, const Value& value) const { set(Value(key), value); }
    void set(const Value& key, const Value& value) const;

    GDExtensionVariantPtr variant() const { return const_cast<uint8_t*>(data_); }

private:
    void make(GDExtensionVariantType type, void* from);
    void to_pointer(GDExtensionVariantType type, GDExtensionTypePtr out) const;
    void swap(Value& other) noexcept {
        for (size_t i = 0; i < sizeof data_; i++) std::swap(data_[i], other.data_[i]);
    }

    alignas(8) uint8_t data_[24];
};

/// Gives back what a Callable holds.
void destroy_callable(void* callable);

/// A new object of a class of the engine.
Value construct(const char* type);
/// A singleton; it lives as long as the engine.
GDExtensionObjectPtr singleton(const char* name);

/// A method that is called by pointer: nothing is allocated, nothing is looked up.
class Method {
public:
    Method(const char* owner, const char* name, int64_t hash);

    template <class R, class... Given>
    R call(GDExtensionObjectPtr object, const Given&... given) const {
        const void* arguments[sizeof...(Given) + 1] = {static_cast<const void*>(&given)..., nullptr};
        R result{};
        engine.object_method_bind_ptrcall(bind_, object, arguments, &result);
        return result;
    }
    template <class... Given>
    void run(GDExtensionObjectPtr object, const Given&... given) const {
        const void* arguments[sizeof...(Given) + 1] = {static_cast<const void*>(&given)..., nullptr};
        engine.object_method_bind_ptrcall(bind_, object, arguments, nullptr);
    }
    GDExtensionMethodBindPtr bind() const { return bind_; }

private:
    GDExtensionMethodBindPtr bind_;
};
#define METHOD(owner, name) ::godot::Method(#owner, #name, hash_##owner##_##name)

}  // namespace godot
