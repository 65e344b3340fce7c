#include "classes.h"

#include <cstring>

namespace godot {

namespace {

void destroy(void* user, GDExtensionClassInstancePtr instance) { static_cast<const ClassRow*>(user)->destroy(static_cast<Instance*>(instance)); }

GDExtensionClassCallVirtual virtual_of(void* user, GDExtensionConstStringNamePtr name, uint32_t) {
    const ClassRow& row = *static_cast<const ClassRow*>(user);
    if (row.overridden == nullptr) return nullptr;
    const Name known(row.overridden);
    return std::memcmp(name, known.get(), sizeof(void*)) == 0 ? row.override_with : nullptr;  // equal names are one
}

/// A call by values. Calls by pointer need a class that compilers know, and ours are hidden.
void call(void* user, GDExtensionClassInstancePtr instance, const GDExtensionConstVariantPtr* given, GDExtensionInt count,
          GDExtensionVariantPtr out, GDExtensionCallError* error) {
    const MethodRow& row = *static_cast<const MethodRow*>(user);
    *error = {GDEXTENSION_CALL_OK, 0, 0};
    if (count != row.count) {
        const bool few = count < row.count;
        error->error = few ? GDEXTENSION_CALL_ERROR_TOO_FEW_ARGUMENTS : GDEXTENSION_CALL_ERROR_TOO_MANY_ARGUMENTS;
        error->expected = static_cast<int32_t>(row.count);
        return;
    }
    Value values[MethodRow::most];
    for (uint32_t i = 0; i < row.count; i++) {
        values[i] = Value::copy(given[i]);
        const GDExtensionVariantType wanted = row.arguments[i].type, held = values[i].type();
        const bool number = wanted == GDEXTENSION_VARIANT_TYPE_FLOAT && held == GDEXTENSION_VARIANT_TYPE_INT;
        if (held == wanted || number) continue;
        *error = {GDEXTENSION_CALL_ERROR_INVALID_ARGUMENT, static_cast<int32_t>(i), static_cast<int32_t>(wanted)};
        return;
    }
    const Value result = row.run(static_cast<Instance*>(instance), values);
    engine.variant_destroy(out);
    engine.variant_new_copy(out, result.variant());
}

/// Texts of a PropertyInfo.
struct Info {
    Info(const Argument& of) : name(of.name), of_class(of.of_class), hint(Value("")) {
        info = {of.type, const_cast<void*>(name.get()), const_cast<void*>(of_class.get()), 0, hint.inner(),
                6};  // PROPERTY_USAGE_DEFAULT
    }
    Name name, of_class;
    Value hint;
    GDExtensionPropertyInfo info;
};

void register_method(const Name& owner, const MethodRow& row) {
    const Name name(row.name);
    Info returns({"", row.returns});
    Info* infos[MethodRow::most];
    GDExtensionPropertyInfo plain[MethodRow::most];
    GDExtensionClassMethodArgumentMetadata metadata[MethodRow::most] = {};
    for (uint32_t i = 0; i < row.count; i++) {
        infos[i] = new Info(row.arguments[i]);
        plain[i] = infos[i]->info;
    }
    GDExtensionClassMethodInfo info = {};
    info.name = const_cast<void*>(name.get());
    info.method_userdata = const_cast<MethodRow*>(&row);
    info.call_func = call;
    info.method_flags = GDEXTENSION_METHOD_FLAG_NORMAL;
    info.has_return_value = row.returns != GDEXTENSION_VARIANT_TYPE_NIL;
    info.return_value_info = &returns.info;
    info.argument_count = row.count;
    info.arguments_info = plain;
    info.arguments_metadata = metadata;
    engine.classdb_register_extension_class_method(library, owner.get(), &info);
    for (uint32_t i = 0; i < row.count; i++) delete infos[i];
}

GDExtensionObjectPtr create(void* user, GDExtensionBool) { return new_object(*static_cast<const ClassRow*>(user)); }

}  // namespace

GDExtensionObjectPtr new_object(const ClassRow& row) {
    const Name parent(row.parent), own(row.name);
    const GDExtensionObjectPtr object = engine.classdb_construct_object2(parent.get());
    Instance* const instance = row.make(object);
    static const GDExtensionInstanceBindingCallbacks none = {nullptr, nullptr, nullptr};
    engine.object_set_instance(object, own.get(), instance);
    engine.object_set_instance_binding(object, library, instance, &none);  // by which instance_of finds it
    return object;
}

void register_class(const ClassRow& row) {
    const Name name(row.name), parent(row.parent);
    GDExtensionClassCreationInfo5 info = {};
    info.is_exposed = 0;  // an exposed class makes a first `--headless --import` crash: godot#111048
    info.create_instance_func = create;
    info.free_instance_func = destroy;
    info.get_virtual_func = virtual_of;
    info.class_userdata = const_cast<ClassRow*>(&row);
    engine.classdb_register_extension_class5(library, name.get(), parent.get(), &info);
    for (size_t i = 0; i < row.method_count; i++) register_method(name, row.methods[i]);
}

void unregister_class(const ClassRow& row) {
    const Name name(row.name);
    engine.classdb_unregister_extension_class(library, name.get());
}

Instance* instance_of(const Value& object, const ClassRow& row) {
    const GDExtensionObjectPtr held = object.to_object();
    void* const found = held == nullptr ? nullptr : engine.object_get_instance_binding(held, library, nullptr);
    return found == nullptr || static_cast<Instance*>(found)->kind != &row ? nullptr : static_cast<Instance*>(found);
}

}  // namespace godot
