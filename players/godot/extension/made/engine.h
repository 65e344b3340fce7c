// Made by `python -m tools.godot.interface` of what Godot 4.6.3 prints (--dump-gdextension-interface-json,
// --dump-extension-api): the types, functions, methods and constants that this folder uses. Names and values are
// Godot's (MIT licence, NOTICE.md).
#pragma once
#include <cstddef>
#include <cstdint>

typedef enum {
    GDEXTENSION_VARIANT_TYPE_NIL = 0,
    GDEXTENSION_VARIANT_TYPE_BOOL = 1,
    GDEXTENSION_VARIANT_TYPE_INT = 2,
    GDEXTENSION_VARIANT_TYPE_FLOAT = 3,
    GDEXTENSION_VARIANT_TYPE_STRING = 4,
    GDEXTENSION_VARIANT_TYPE_VECTOR2 = 5,
    GDEXTENSION_VARIANT_TYPE_VECTOR2I = 6,
    GDEXTENSION_VARIANT_TYPE_RECT2 = 7,
    GDEXTENSION_VARIANT_TYPE_RECT2I = 8,
    GDEXTENSION_VARIANT_TYPE_VECTOR3 = 9,
    GDEXTENSION_VARIANT_TYPE_VECTOR3I = 10,
    GDEXTENSION_VARIANT_TYPE_TRANSFORM2D = 11,
    GDEXTENSION_VARIANT_TYPE_VECTOR4 = 12,
    GDEXTENSION_VARIANT_TYPE_VECTOR4I = 13,
    GDEXTENSION_VARIANT_TYPE_PLANE = 14,
    GDEXTENSION_VARIANT_TYPE_QUATERNION = 15,
    GDEXTENSION_VARIANT_TYPE_AABB = 16,
    GDEXTENSION_VARIANT_TYPE_BASIS = 17,
    GDEXTENSION_VARIANT_TYPE_TRANSFORM3D = 18,
    GDEXTENSION_VARIANT_TYPE_PROJECTION = 19,
    GDEXTENSION_VARIANT_TYPE_COLOR = 20,
    GDEXTENSION_VARIANT_TYPE_STRING_NAME = 21,
    GDEXTENSION_VARIANT_TYPE_NODE_PATH = 22,
    GDEXTENSION_VARIANT_TYPE_RID = 23,
    GDEXTENSION_VARIANT_TYPE_OBJECT = 24,
    GDEXTENSION_VARIANT_TYPE_CALLABLE = 25,
    GDEXTENSION_VARIANT_TYPE_SIGNAL = 26,
    GDEXTENSION_VARIANT_TYPE_DICTIONARY = 27,
    GDEXTENSION_VARIANT_TYPE_ARRAY = 28,
    GDEXTENSION_VARIANT_TYPE_PACKED_BYTE_ARRAY = 29,
    GDEXTENSION_VARIANT_TYPE_PACKED_INT32_ARRAY = 30,
    GDEXTENSION_VARIANT_TYPE_PACKED_INT64_ARRAY = 31,
    GDEXTENSION_VARIANT_TYPE_PACKED_FLOAT32_ARRAY = 32,
    GDEXTENSION_VARIANT_TYPE_PACKED_FLOAT64_ARRAY = 33,
    GDEXTENSION_VARIANT_TYPE_PACKED_STRING_ARRAY = 34,
    GDEXTENSION_VARIANT_TYPE_PACKED_VECTOR2_ARRAY = 35,
    GDEXTENSION_VARIANT_TYPE_PACKED_VECTOR3_ARRAY = 36,
    GDEXTENSION_VARIANT_TYPE_PACKED_COLOR_ARRAY = 37,
    GDEXTENSION_VARIANT_TYPE_PACKED_VECTOR4_ARRAY = 38,
    GDEXTENSION_VARIANT_TYPE_VARIANT_MAX = 39,
} GDExtensionVariantType;
typedef void* GDExtensionVariantPtr;
typedef const void* GDExtensionConstVariantPtr;
typedef void* GDExtensionUninitializedVariantPtr;
typedef void* GDExtensionStringNamePtr;
typedef const void* GDExtensionConstStringNamePtr;
typedef void* GDExtensionUninitializedStringNamePtr;
typedef void* GDExtensionStringPtr;
typedef const void* GDExtensionConstStringPtr;
typedef void* GDExtensionUninitializedStringPtr;
typedef void* GDExtensionObjectPtr;
typedef void* GDExtensionTypePtr;
typedef const void* GDExtensionConstTypePtr;
typedef void* GDExtensionUninitializedTypePtr;
typedef const void* GDExtensionMethodBindPtr;
typedef int64_t GDExtensionInt;
typedef uint8_t GDExtensionBool;
typedef uint64_t GDObjectInstanceID;
typedef enum {
    GDEXTENSION_CALL_OK = 0,
    GDEXTENSION_CALL_ERROR_INVALID_METHOD = 1,
    GDEXTENSION_CALL_ERROR_INVALID_ARGUMENT = 2,
    GDEXTENSION_CALL_ERROR_TOO_MANY_ARGUMENTS = 3,
    GDEXTENSION_CALL_ERROR_TOO_FEW_ARGUMENTS = 4,
    GDEXTENSION_CALL_ERROR_INSTANCE_IS_NULL = 5,
    GDEXTENSION_CALL_ERROR_METHOD_NOT_CONST = 6,
} GDExtensionCallErrorType;
typedef struct {
    GDExtensionCallErrorType error;
    int32_t argument;
    int32_t expected;
} GDExtensionCallError;
typedef void (*GDExtensionVariantFromTypeConstructorFunc)(GDExtensionUninitializedVariantPtr, GDExtensionTypePtr);
typedef void (*GDExtensionTypeFromVariantConstructorFunc)(GDExtensionUninitializedTypePtr, GDExtensionVariantPtr);
typedef void* (*GDExtensionVariantGetInternalPtrFunc)(GDExtensionVariantPtr);
typedef void (*GDExtensionPtrDestructor)(GDExtensionTypePtr);
typedef void* (*GDExtensionInstanceBindingCreateCallback)(void*, void*);
typedef void (*GDExtensionInstanceBindingFreeCallback)(void*, void*, void*);
typedef GDExtensionBool (*GDExtensionInstanceBindingReferenceCallback)(void*, void*, GDExtensionBool);
typedef struct {
    GDExtensionInstanceBindingCreateCallback create_callback;
    GDExtensionInstanceBindingFreeCallback free_callback;
    GDExtensionInstanceBindingReferenceCallback reference_callback;
} GDExtensionInstanceBindingCallbacks;
typedef void* GDExtensionClassInstancePtr;
typedef GDExtensionBool (*GDExtensionClassSet)(GDExtensionClassInstancePtr, GDExtensionConstStringNamePtr, GDExtensionConstVariantPtr);
typedef GDExtensionBool (*GDExtensionClassGet)(GDExtensionClassInstancePtr, GDExtensionConstStringNamePtr, GDExtensionVariantPtr);
typedef struct {
    GDExtensionVariantType type;
    GDExtensionStringNamePtr name;
    GDExtensionStringNamePtr class_name;
    uint32_t hint;
    GDExtensionStringPtr hint_string;
    uint32_t usage;
} GDExtensionPropertyInfo;
typedef struct {
    GDExtensionStringNamePtr name;
    GDExtensionPropertyInfo return_value;
    uint32_t flags;
    int32_t id;
    uint32_t argument_count;
    GDExtensionPropertyInfo* arguments;
    uint32_t default_argument_count;
    GDExtensionVariantPtr* default_arguments;
} GDExtensionMethodInfo;
typedef const GDExtensionPropertyInfo* (*GDExtensionClassGetPropertyList)(GDExtensionClassInstancePtr, uint32_t*);
typedef void (*GDExtensionClassFreePropertyList2)(GDExtensionClassInstancePtr, const GDExtensionPropertyInfo*, uint32_t);
typedef GDExtensionBool (*GDExtensionClassPropertyCanRevert)(GDExtensionClassInstancePtr, GDExtensionConstStringNamePtr);
typedef GDExtensionBool (*GDExtensionClassPropertyGetRevert)(GDExtensionClassInstancePtr, GDExtensionConstStringNamePtr, GDExtensionVariantPtr);
typedef GDExtensionBool (*GDExtensionClassValidateProperty)(GDExtensionClassInstancePtr, GDExtensionPropertyInfo*);
typedef void (*GDExtensionClassNotification2)(GDExtensionClassInstancePtr, int32_t, GDExtensionBool);
typedef void (*GDExtensionClassToString)(GDExtensionClassInstancePtr, GDExtensionBool*, GDExtensionStringPtr);
typedef void (*GDExtensionClassReference)(GDExtensionClassInstancePtr);
typedef void (*GDExtensionClassUnreference)(GDExtensionClassInstancePtr);
typedef void (*GDExtensionClassCallVirtual)(GDExtensionClassInstancePtr, const GDExtensionConstTypePtr*, GDExtensionTypePtr);
typedef GDExtensionObjectPtr (*GDExtensionClassCreateInstance2)(void*, GDExtensionBool);
typedef void (*GDExtensionClassFreeInstance)(void*, GDExtensionClassInstancePtr);
typedef GDExtensionClassInstancePtr (*GDExtensionClassRecreateInstance)(void*, GDExtensionObjectPtr);
typedef GDExtensionClassCallVirtual (*GDExtensionClassGetVirtual2)(void*, GDExtensionConstStringNamePtr, uint32_t);
typedef void* (*GDExtensionClassGetVirtualCallData2)(void*, GDExtensionConstStringNamePtr, uint32_t);
typedef void (*GDExtensionClassCallVirtualWithData)(GDExtensionClassInstancePtr, GDExtensionConstStringNamePtr, void*, const GDExtensionConstTypePtr*, GDExtensionTypePtr);
typedef struct {
    GDExtensionBool is_virtual;
    GDExtensionBool is_abstract;
    GDExtensionBool is_exposed;
    GDExtensionBool is_runtime;
    GDExtensionConstStringPtr icon_path;
    GDExtensionClassSet set_func;
    GDExtensionClassGet get_func;
    GDExtensionClassGetPropertyList get_property_list_func;
    GDExtensionClassFreePropertyList2 free_property_list_func;
    GDExtensionClassPropertyCanRevert property_can_revert_func;
    GDExtensionClassPropertyGetRevert property_get_revert_func;
    GDExtensionClassValidateProperty validate_property_func;
    GDExtensionClassNotification2 notification_func;
    GDExtensionClassToString to_string_func;
    GDExtensionClassReference reference_func;
    GDExtensionClassUnreference unreference_func;
    GDExtensionClassCreateInstance2 create_instance_func;
    GDExtensionClassFreeInstance free_instance_func;
    GDExtensionClassRecreateInstance recreate_instance_func;
    GDExtensionClassGetVirtual2 get_virtual_func;
    GDExtensionClassGetVirtualCallData2 get_virtual_call_data_func;
    GDExtensionClassCallVirtualWithData call_virtual_with_data_func;
    void* class_userdata;
} GDExtensionClassCreationInfo4;
typedef GDExtensionClassCreationInfo4 GDExtensionClassCreationInfo5;
typedef void* GDExtensionClassLibraryPtr;
typedef enum {
    GDEXTENSION_METHOD_FLAG_NORMAL = 1,
    GDEXTENSION_METHOD_FLAG_EDITOR = 2,
    GDEXTENSION_METHOD_FLAG_CONST = 4,
    GDEXTENSION_METHOD_FLAG_VIRTUAL = 8,
    GDEXTENSION_METHOD_FLAG_VARARG = 16,
    GDEXTENSION_METHOD_FLAG_STATIC = 32,
    GDEXTENSION_METHOD_FLAG_VIRTUAL_REQUIRED = 128,
    GDEXTENSION_METHOD_FLAGS_DEFAULT = 1,
} GDExtensionClassMethodFlags;
typedef enum {
    GDEXTENSION_METHOD_ARGUMENT_METADATA_NONE = 0,
    GDEXTENSION_METHOD_ARGUMENT_METADATA_INT_IS_INT8 = 1,
    GDEXTENSION_METHOD_ARGUMENT_METADATA_INT_IS_INT16 = 2,
    GDEXTENSION_METHOD_ARGUMENT_METADATA_INT_IS_INT32 = 3,
    GDEXTENSION_METHOD_ARGUMENT_METADATA_INT_IS_INT64 = 4,
    GDEXTENSION_METHOD_ARGUMENT_METADATA_INT_IS_UINT8 = 5,
    GDEXTENSION_METHOD_ARGUMENT_METADATA_INT_IS_UINT16 = 6,
    GDEXTENSION_METHOD_ARGUMENT_METADATA_INT_IS_UINT32 = 7,
    GDEXTENSION_METHOD_ARGUMENT_METADATA_INT_IS_UINT64 = 8,
    GDEXTENSION_METHOD_ARGUMENT_METADATA_REAL_IS_FLOAT = 9,
    GDEXTENSION_METHOD_ARGUMENT_METADATA_REAL_IS_DOUBLE = 10,
    GDEXTENSION_METHOD_ARGUMENT_METADATA_INT_IS_CHAR16 = 11,
    GDEXTENSION_METHOD_ARGUMENT_METADATA_INT_IS_CHAR32 = 12,
    GDEXTENSION_METHOD_ARGUMENT_METADATA_OBJECT_IS_REQUIRED = 13,
} GDExtensionClassMethodArgumentMetadata;
typedef void (*GDExtensionClassMethodCall)(void*, GDExtensionClassInstancePtr, const GDExtensionConstVariantPtr*, GDExtensionInt, GDExtensionVariantPtr, GDExtensionCallError*);
typedef void (*GDExtensionClassMethodPtrCall)(void*, GDExtensionClassInstancePtr, const GDExtensionConstTypePtr*, GDExtensionTypePtr);
typedef struct {
    GDExtensionStringNamePtr name;
    void* method_userdata;
    GDExtensionClassMethodCall call_func;
    GDExtensionClassMethodPtrCall ptrcall_func;
    uint32_t method_flags;
    GDExtensionBool has_return_value;
    GDExtensionPropertyInfo* return_value_info;
    GDExtensionClassMethodArgumentMetadata return_value_metadata;
    uint32_t argument_count;
    GDExtensionPropertyInfo* arguments_info;
    GDExtensionClassMethodArgumentMetadata* arguments_metadata;
    uint32_t default_argument_count;
    GDExtensionVariantPtr* default_arguments;
} GDExtensionClassMethodInfo;
typedef void (*GDExtensionCallableCustomCall)(void*, const GDExtensionConstVariantPtr*, GDExtensionInt, GDExtensionVariantPtr, GDExtensionCallError*);
typedef GDExtensionBool (*GDExtensionCallableCustomIsValid)(void*);
typedef void (*GDExtensionCallableCustomFree)(void*);
typedef uint32_t (*GDExtensionCallableCustomHash)(void*);
typedef GDExtensionBool (*GDExtensionCallableCustomEqual)(void*, void*);
typedef GDExtensionBool (*GDExtensionCallableCustomLessThan)(void*, void*);
typedef void (*GDExtensionCallableCustomToString)(void*, GDExtensionBool*, GDExtensionStringPtr);
typedef GDExtensionInt (*GDExtensionCallableCustomGetArgumentCount)(void*, GDExtensionBool*);
typedef struct {
    void* callable_userdata;
    void* token;
    GDObjectInstanceID object_id;
    GDExtensionCallableCustomCall call_func;
    GDExtensionCallableCustomIsValid is_valid_func;
    GDExtensionCallableCustomFree free_func;
    GDExtensionCallableCustomHash hash_func;
    GDExtensionCallableCustomEqual equal_func;
    GDExtensionCallableCustomLessThan less_than_func;
    GDExtensionCallableCustomToString to_string_func;
    GDExtensionCallableCustomGetArgumentCount get_argument_count_func;
} GDExtensionCallableCustomInfo2;
typedef enum {
    GDEXTENSION_INITIALIZATION_CORE = 0,
    GDEXTENSION_INITIALIZATION_SERVERS = 1,
    GDEXTENSION_INITIALIZATION_SCENE = 2,
    GDEXTENSION_INITIALIZATION_EDITOR = 3,
    GDEXTENSION_MAX_INITIALIZATION_LEVEL = 4,
} GDExtensionInitializationLevel;
typedef void (*GDExtensionInitializeCallback)(void*, GDExtensionInitializationLevel);
typedef void (*GDExtensionDeinitializeCallback)(void*, GDExtensionInitializationLevel);
typedef struct {
    GDExtensionInitializationLevel minimum_initialization_level;
    void* userdata;
    GDExtensionInitializeCallback initialize;
    GDExtensionDeinitializeCallback deinitialize;
} GDExtensionInitialization;
typedef void (*GDExtensionInterfaceFunctionPtr)();
typedef GDExtensionInterfaceFunctionPtr (*GDExtensionInterfaceGetProcAddress)(const char*);

/// The functions of the engine's interface.
struct EngineFunctions {
    void (*callable_custom_create2)(GDExtensionUninitializedTypePtr, GDExtensionCallableCustomInfo2*);
    GDExtensionObjectPtr (*classdb_construct_object2)(GDExtensionConstStringNamePtr);
    GDExtensionMethodBindPtr (*classdb_get_method_bind)(GDExtensionConstStringNamePtr, GDExtensionConstStringNamePtr, GDExtensionInt);
    void (*classdb_register_extension_class5)(GDExtensionClassLibraryPtr, GDExtensionConstStringNamePtr, GDExtensionConstStringNamePtr, const GDExtensionClassCreationInfo5*);
    void (*classdb_register_extension_class_method)(GDExtensionClassLibraryPtr, GDExtensionConstStringNamePtr, const GDExtensionClassMethodInfo*);
    void (*classdb_unregister_extension_class)(GDExtensionClassLibraryPtr, GDExtensionConstStringNamePtr);
    GDExtensionVariantFromTypeConstructorFunc (*get_variant_from_type_constructor)(GDExtensionVariantType);
    GDExtensionTypeFromVariantConstructorFunc (*get_variant_to_type_constructor)(GDExtensionVariantType);
    GDExtensionObjectPtr (*global_get_singleton)(GDExtensionConstStringNamePtr);
    void (*object_destroy)(GDExtensionObjectPtr);
    void* (*object_get_instance_binding)(GDExtensionObjectPtr, void*, const GDExtensionInstanceBindingCallbacks*);
    void (*object_method_bind_ptrcall)(GDExtensionMethodBindPtr, GDExtensionObjectPtr, const GDExtensionConstTypePtr*, GDExtensionTypePtr);
    void (*object_set_instance)(GDExtensionObjectPtr, GDExtensionConstStringNamePtr, GDExtensionClassInstancePtr);
    void (*object_set_instance_binding)(GDExtensionObjectPtr, void*, void*, const GDExtensionInstanceBindingCallbacks*);
    uint8_t* (*packed_byte_array_operator_index)(GDExtensionTypePtr, GDExtensionInt);
    float* (*packed_float32_array_operator_index)(GDExtensionTypePtr, GDExtensionInt);
    void (*print_error)(const char*, const char*, const char*, int32_t, GDExtensionBool);
    void (*string_name_new_with_latin1_chars)(GDExtensionUninitializedStringNamePtr, const char*, GDExtensionBool);
    void (*string_new_with_utf8_chars)(GDExtensionUninitializedStringPtr, const char*);
    GDExtensionInt (*string_to_utf8_chars)(GDExtensionConstStringPtr, char*, GDExtensionInt);
    void (*variant_call)(GDExtensionVariantPtr, GDExtensionConstStringNamePtr, const GDExtensionConstVariantPtr*, GDExtensionInt, GDExtensionUninitializedVariantPtr, GDExtensionCallError*);
    void (*variant_construct)(GDExtensionVariantType, GDExtensionUninitializedVariantPtr, const GDExtensionConstVariantPtr*, int32_t, GDExtensionCallError*);
    void (*variant_destroy)(GDExtensionVariantPtr);
    GDExtensionPtrDestructor (*variant_get_ptr_destructor)(GDExtensionVariantType);
    GDExtensionVariantGetInternalPtrFunc (*variant_get_ptr_internal_getter)(GDExtensionVariantType);
    GDExtensionVariantType (*variant_get_type)(GDExtensionConstVariantPtr);
    void (*variant_new_copy)(GDExtensionUninitializedVariantPtr, GDExtensionConstVariantPtr);
    void (*variant_new_nil)(GDExtensionUninitializedVariantPtr);
    void (*variant_set_keyed)(GDExtensionVariantPtr, GDExtensionConstVariantPtr, GDExtensionConstVariantPtr, GDExtensionBool*);
    bool load(GDExtensionInterfaceGetProcAddress get) {
        return load(get, "callable_custom_create2", callable_custom_create2) &&
            load(get, "classdb_construct_object2", classdb_construct_object2) &&
            load(get, "classdb_get_method_bind", classdb_get_method_bind) &&
            load(get, "classdb_register_extension_class5", classdb_register_extension_class5) &&
            load(get, "classdb_register_extension_class_method", classdb_register_extension_class_method) &&
            load(get, "classdb_unregister_extension_class", classdb_unregister_extension_class) &&
            load(get, "get_variant_from_type_constructor", get_variant_from_type_constructor) &&
            load(get, "get_variant_to_type_constructor", get_variant_to_type_constructor) &&
            load(get, "global_get_singleton", global_get_singleton) &&
            load(get, "object_destroy", object_destroy) &&
            load(get, "object_get_instance_binding", object_get_instance_binding) &&
            load(get, "object_method_bind_ptrcall", object_method_bind_ptrcall) &&
            load(get, "object_set_instance", object_set_instance) &&
            load(get, "object_set_instance_binding", object_set_instance_binding) &&
            load(get, "packed_byte_array_operator_index", packed_byte_array_operator_index) &&
            load(get, "packed_float32_array_operator_index", packed_float32_array_operator_index) &&
            load(get, "print_error", print_error) &&
            load(get, "string_name_new_with_latin1_chars", string_name_new_with_latin1_chars) &&
            load(get, "string_new_with_utf8_chars", string_new_with_utf8_chars) &&
            load(get, "string_to_utf8_chars", string_to_utf8_chars) &&
            load(get, "variant_call", variant_call) &&
            load(get, "variant_construct", variant_construct) &&
            load(get, "variant_destroy", variant_destroy) &&
            load(get, "variant_get_ptr_destructor", variant_get_ptr_destructor) &&
            load(get, "variant_get_ptr_internal_getter", variant_get_ptr_internal_getter) &&
            load(get, "variant_get_type", variant_get_type) &&
            load(get, "variant_new_copy", variant_new_copy) &&
            load(get, "variant_new_nil", variant_new_nil) &&
            load(get, "variant_set_keyed", variant_set_keyed);
    }
    template <class Function>
    static bool load(GDExtensionInterfaceGetProcAddress get, const char* name, Function& function) {
        function = reinterpret_cast<Function>(get(name));
        return function != nullptr;
    }
};

enum : int64_t {
    hash_CompositorEffect_set_access_resolved_color = 2586408642,
    hash_CompositorEffect_set_access_resolved_depth = 2586408642,
    hash_CompositorEffect_set_effect_callback_type = 1390728419,
    hash_Engine_get_frames_drawn = 2455072627,
    hash_RefCounted_unreference = 2240911060,
    hash_RenderData_get_render_scene_buffers = 2793216201,
    hash_RenderData_get_render_scene_data = 1288715698,
    hash_RenderSceneBuffersRD_get_color_layer = 3087988589,
    hash_RenderSceneBuffersRD_get_depth_layer = 3087988589,
    hash_RenderSceneBuffersRD_get_internal_size = 3690982128,
    hash_RenderSceneBuffersRD_get_msaa_3d = 3109158617,
    hash_RenderSceneData_get_cam_projection = 2910717950,
    hash_RenderSceneData_get_cam_transform = 3229777777,
    hash_RenderSceneData_get_view_count = 3905245786,
    hash_RenderSceneData_get_view_projection = 3179846605,
    hash_RenderingDevice_buffer_update = 3454956949,
    hash_RenderingDevice_compute_list_add_barrier = 1286410249,
    hash_RenderingDevice_compute_list_begin = 2455072627,
    hash_RenderingDevice_compute_list_bind_compute_pipeline = 4040184819,
    hash_RenderingDevice_compute_list_bind_uniform_set = 749655778,
    hash_RenderingDevice_compute_list_dispatch = 4275841770,
    hash_RenderingDevice_compute_list_end = 3218959716,
    hash_RenderingDevice_draw_list_begin = 1317926357,
    hash_RenderingDevice_draw_list_bind_render_pipeline = 4040184819,
    hash_RenderingDevice_draw_list_bind_uniform_set = 749655778,
    hash_RenderingDevice_draw_list_draw = 4230067973,
    hash_RenderingDevice_draw_list_end = 3218959716,
    hash_RenderingDevice_framebuffer_is_valid = 4155700596,
    hash_RenderingDevice_free_rid = 2722037293,
    hash_RenderingDevice_uniform_set_is_valid = 3521089500,
};

enum : int64_t {
    CompositorEffect_EFFECT_CALLBACK_TYPE_POST_TRANSPARENT = 4,
    RenderingDevice_BLEND_FACTOR_CONSTANT_COLOR = 10,
    RenderingDevice_BLEND_FACTOR_ONE = 1,
    RenderingDevice_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA = 7,
    RenderingDevice_COMPARE_OP_ALWAYS = 7,
    RenderingDevice_COMPARE_OP_GREATER_OR_EQUAL = 6,
    RenderingDevice_DATA_FORMAT_A2B10G10R10_UNORM_PACK32 = 63,
    RenderingDevice_DATA_FORMAT_D32_SFLOAT = 125,
    RenderingDevice_DATA_FORMAT_R32G32B32A32_SFLOAT = 108,
    RenderingDevice_DRAW_CLEAR_ALL = 327935,
    RenderingDevice_DRAW_DEFAULT_ALL = 0,
    RenderingDevice_RENDER_PRIMITIVE_TRIANGLES = 5,
    RenderingDevice_RENDER_PRIMITIVE_TRIANGLE_STRIPS = 7,
    RenderingDevice_SHADER_STAGE_COMPUTE = 4,
    RenderingDevice_SHADER_STAGE_FRAGMENT = 1,
    RenderingDevice_SHADER_STAGE_VERTEX = 0,
    RenderingDevice_TEXTURE_SAMPLES_1 = 0,
    RenderingDevice_TEXTURE_USAGE_CAN_COPY_FROM_BIT = 128,
    RenderingDevice_TEXTURE_USAGE_COLOR_ATTACHMENT_BIT = 2,
    RenderingDevice_TEXTURE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT = 4,
    RenderingDevice_TEXTURE_USAGE_SAMPLING_BIT = 1,
    RenderingDevice_UNIFORM_TYPE_STORAGE_BUFFER = 8,
    RenderingDevice_UNIFORM_TYPE_TEXTURE = 2,
    RenderingDevice_UNIFORM_TYPE_UNIFORM_BUFFER = 7,
};
