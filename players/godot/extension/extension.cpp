// Where the engine enters.
#include "effect.h"

using namespace godot;

// Classes are hidden (classes.cpp says why), and the engine makes no hidden class for a script: this singleton does.
static const char maker_name[] = "GaussianAvatarMaker";
static const MethodRow makes[] = {
    {"core", [](Instance*, const Value*) { return Value::object(new_object(Core::row)); }, GDEXTENSION_VARIANT_TYPE_OBJECT, {}, 0},
    {"effect", [](Instance*, const Value*) { return Value::object(new_object(Effect::row)); }, GDEXTENSION_VARIANT_TYPE_OBJECT, {}, 0},
};
static Instance only = {nullptr};
static const ClassRow maker = {
    maker_name, "Object", [](GDExtensionObjectPtr) { return &only; }, [](Instance*) {}, nullptr, nullptr, makes, 2};
static GDExtensionObjectPtr made = nullptr;

static void begin(void*, GDExtensionInitializationLevel level) {
    if (level != GDEXTENSION_INITIALIZATION_SCENE) return;
    for (const ClassRow* row : {&Core::row, &Effect::row, &maker}) register_class(*row);
    made = new_object(maker);
    const Name name(maker_name);
    Value::object(singleton("Engine")).call("register_singleton", {name, Value::object(made)});
}

static void end(void*, GDExtensionInitializationLevel level) {
    if (level != GDEXTENSION_INITIALIZATION_SCENE) return;
    const Name name(maker_name);
    Value::object(singleton("Engine")).call("unregister_singleton", {name});
    engine.object_destroy(made);
    for (const ClassRow* row : {&maker, &Effect::row, &Core::row}) unregister_class(*row);
}

#ifdef _WIN32
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

extern "C" EXPORTED GDExtensionBool gaussian_avatar_init(GDExtensionInterfaceGetProcAddress get, GDExtensionClassLibraryPtr own,
                                                         GDExtensionInitialization* out) {
    if (!load_engine(get, own)) return 0;
    *out = {GDEXTENSION_INITIALIZATION_SCENE, nullptr, begin, end};
    return 1;
}
