#include "values.h"

#include <cstring>

namespace godot {

EngineFunctions engine = {};
GDExtensionClassLibraryPtr library = nullptr;

namespace {

constexpr int types = GDEXTENSION_VARIANT_TYPE_VARIANT_MAX;
GDExtensionVariantFromTypeConstructorFunc from_type[types];
GDExtensionTypeFromVariantConstructorFunc to_type[types];
GDExtensionVariantGetInternalPtrFunc inner_of[types];
GDExtensionPtrDestructor destroy_name, destroy_string, destroy_call;

}  // namespace

bool load_engine(GDExtensionInterfaceGetProcAddress get, GDExtensionClassLibraryPtr own) {
    library = own;
    if (!engine.load(get)) return false;
    for (int i = 1; i < types; i++) {
        const auto type = static_cast<GDExtensionVariantType>(i);
        from_type[i] = engine.get_variant_from_type_constructor(type);
        to_type[i] = engine.get_variant_to_type_constructor(type);
        inner_of[i] = engine.variant_get_ptr_internal_getter(type);
    }
    destroy_name = engine.variant_get_ptr_destructor(GDEXTENSION_VARIANT_TYPE_STRING_NAME);
    destroy_string = engine.variant_get_ptr_destructor(GDEXTENSION_VARIANT_TYPE_STRING);
    destroy_call = engine.variant_get_ptr_destructor(GDEXTENSION_VARIANT_TYPE_CALLABLE);
    return true;
}

void destroy_callable(void* callable) { destroy_call(callable); }

Name::~Name() { destroy_name(&data_); }

void Value::make(GDExtensionVariantType type, void* from) { from_type[type](data_, from); }

Value::Value(const char* utf8) {
    void* text = nullptr;
    engine.string_new_with_utf8_chars(&text, utf8 == nullptr ? "" : utf8);
    make(GDEXTENSION_VARIANT_TYPE_STRING, &text);
    destroy_string(&text);
}

Value Value::object(GDExtensionObjectPtr object) { return of_pointer(GDEXTENSION_VARIANT_TYPE_OBJECT, &object); }

Value Value::empty(GDExtensionVariantType type) {
    Value made;
    GDExtensionCallError error;
    engine.variant_destroy(made.data_);
    engine.variant_construct(type, made.data_, nullptr, 0, &error);
    return made;
}

Value Value::bytes(size_t size, const void* content) {
    Value made = empty(GDEXTENSION_VARIANT_TYPE_PACKED_BYTE_ARRAY);
    if (size > 0) made.call("resize", {static_cast<int64_t>(size)});
    if (size > 0 && content != nullptr) std::memcpy(made.bytes_data(), content, size);
    return made;
}

Value Value::floats(size_t count, const float* content) {
    Value made = empty(GDEXTENSION_VARIANT_TYPE_PACKED_FLOAT32_ARRAY);
    if (count > 0) made.call("resize", {static_cast<int64_t>(count)});
    if (count > 0 && content != nullptr) std::memcpy(made.floats_data(), content, count * sizeof(float));
    return made;
}

Value Value::copy(GDExtensionConstVariantPtr other) {
    Value made;
    engine.variant_destroy(made.data_);
    engine.variant_new_copy(made.data_, other);
    return made;
}

Value Value::of_pointer(GDExtensionVariantType type, GDExtensionConstTypePtr pointer) {
    Value made;
    engine.variant_destroy(made.data_);
    made.make(type, const_cast<void*>(pointer));
    return made;
}

void Value::to_pointer(GDExtensionVariantType type, GDExtensionTypePtr out) const {
    to_type[type](out, const_cast<uint8_t*>(data_));
}

int64_t Value::to_int() const {
    int64_t value = 0;
    const GDExtensionVariantType held = type();
    if (held == GDEXTENSION_VARIANT_TYPE_FLOAT) return static_cast<int64_t>(to_float());
    if (held == GDEXTENSION_VARIANT_TYPE_INT || held == GDEXTENSION_VARIANT_TYPE_BOOL) {
        to_pointer(GDEXTENSION_VARIANT_TYPE_INT, &value);
    }
    return value;
}

double Value::to_float() const {
    double value = 0;
    if (type() == GDEXTENSION_VARIANT_TYPE_INT) return static_cast<double>(to_int());
    if (type() == GDEXTENSION_VARIANT_TYPE_FLOAT) to_pointer(GDEXTENSION_VARIANT_TYPE_FLOAT, &value);
    return value;
}

Rid Value::to_rid() const {
    Rid value;
    if (type() == GDEXTENSION_VARIANT_TYPE_RID) to_pointer(GDEXTENSION_VARIANT_TYPE_RID, &value);
    return value;
}

Transform3D Value::to_transform() const {
    Transform3D value = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
    if (type() == GDEXTENSION_VARIANT_TYPE_TRANSFORM3D) to_pointer(GDEXTENSION_VARIANT_TYPE_TRANSFORM3D, &value);
    return value;
}

GDExtensionObjectPtr Value::to_object() const {
    GDExtensionObjectPtr value = nullptr;
    if (type() == GDEXTENSION_VARIANT_TYPE_OBJECT) to_pointer(GDEXTENSION_VARIANT_TYPE_OBJECT, &value);
    return value;
}

size_t Value::to_utf8(char* out, size_t size) const {
    if (size > 0) out[0] = 0;
    if (type() != GDEXTENSION_VARIANT_TYPE_STRING) return 0;
    const GDExtensionInt needed = engine.string_to_utf8_chars(inner(), nullptr, 0);
    const GDExtensionInt room = size == 0 ? 0 : static_cast<GDExtensionInt>(size - 1);
    const GDExtensionInt written = needed < room ? needed : room;
    engine.string_to_utf8_chars(inner(), out, written);
    if (size > 0) out[written] = 0;
    return static_cast<size_t>(needed);
}

void* Value::inner() const { return inner_of[type()](variant()); }

size_t Value::size() const { return static_cast<size_t>(call("size").to_int()); }

uint8_t* Value::bytes_data() const { return engine.packed_byte_array_operator_index(inner(), 0); }

float* Value::floats_data() const { return engine.packed_float32_array_operator_index(inner(), 0); }

Value Value::call(const char* method, std::initializer_list<Value> given) const {
    const void* arguments[16];
    size_t count = 0;
    for (const Value& one : given) arguments[count++] = one.data_;
    Value result;
    GDExtensionCallError error = {};
    const Name name(method);
    engine.variant_destroy(result.data_);
    engine.variant_call(variant(), name.get(), arguments, static_cast<GDExtensionInt>(count), result.data_, &error);
    if (error.error != GDEXTENSION_CALL_OK) engine.print_error(method, "Value::call", "players/godot", __LINE__, 0);
    return result;
}

void Value::set(const Value& key, const Value& value) const {
    GDExtensionBool valid = 0;
    engine.variant_set_keyed(variant(), key.data_, value.data_, &valid);
}

Value construct(const char* type) {
    const Name name(type);
    return Value::object(engine.classdb_construct_object2(name.get()));
}

GDExtensionObjectPtr singleton(const char* name) {
    const Name made(name);
    return engine.global_get_singleton(made.get());
}

Method::Method(const char* owner, const char* name, int64_t hash) {
    const Name of(owner), called(name);
    bind_ = engine.classdb_get_method_bind(of.get(), called.get(), hash);
    if (bind_ == nullptr) engine.print_error(name, owner, "players/godot", __LINE__, 0);
}

}  // namespace godot
