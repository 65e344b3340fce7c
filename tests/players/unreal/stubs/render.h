// Stubs of Unreal's modules RenderCore, RHI, Renderer, and of views in Engine. ENGINE_MINOR_VERSION says which release.
#pragma once
#include "engine.h"

// ---- RHI
namespace ERHIFeatureLevel { enum Type { ES3_1, SM5 }; }
enum EShaderPlatform { SP_Stub };
extern ERHIFeatureLevel::Type GMaxRHIFeatureLevel;
bool IsFeatureLevelSupported(EShaderPlatform platform, ERHIFeatureLevel::Type level);
enum EPixelFormat { PF_DepthStencil, PF_A32B32G32R32F };
enum class ETextureCreateFlags : uint64 {};
constexpr ETextureCreateFlags TexCreate_DepthStencilTargetable{}, TexCreate_RenderTargetable{}, TexCreate_ShaderResource{};
inline ETextureCreateFlags& operator|=(ETextureCreateFlags& a, ETextureCreateFlags) { return a; }
constexpr ETextureCreateFlags operator|(ETextureCreateFlags a, ETextureCreateFlags) { return a; }
struct FClearValueBinding {
    static const FClearValueBinding DepthFar;
    static const FClearValueBinding Transparent;
};
enum class ERenderTargetLoadAction { ENoAction, ELoad, EClear };
struct FExclusiveDepthStencil {
    enum Type { DepthWrite_StencilNop, DepthRead_StencilNop };
    FExclusiveDepthStencil(Type type);
};
enum EPrimitiveType { PT_TriangleStrip };
enum EColorWriteMask { CW_RGBA };
enum EBlendOperation { BO_Add };
enum EBlendFactor { BF_One, BF_InverseSourceAlpha };
enum ERasterizerFillMode { FM_Solid };
enum ERasterizerCullMode { CM_None };
enum ECompareFunction { CF_Always, CF_DepthNearOrEqual };
class FRHIBlendState;
class FRHIRasterizerState;
class FRHIDepthStencilState;
class FRHIVertexShader;
class FRHIPixelShader;
class FRHIVertexDeclaration;
class FRHIBuffer;
template <EColorWriteMask, EBlendOperation, EBlendFactor, EBlendFactor, EBlendOperation, EBlendFactor, EBlendFactor>
struct TStaticBlendState { static FRHIBlendState* GetRHI(); };
template <ERasterizerFillMode, ERasterizerCullMode> struct TStaticRasterizerState { static FRHIRasterizerState* GetRHI(); };
template <bool, ECompareFunction> struct TStaticDepthStencilState { static FRHIDepthStencilState* GetRHI(); };
struct FEmptyVertexDeclaration { FRHIVertexDeclaration* VertexDeclarationRHI; };
extern FEmptyVertexDeclaration GEmptyVertexDeclaration;
struct FGraphicsPipelineStateInitializer {
    FRHIBlendState* BlendState;
    FRHIRasterizerState* RasterizerState;
    FRHIDepthStencilState* DepthStencilState;
    struct { FRHIVertexDeclaration* VertexDeclarationRHI; FRHIVertexShader* VertexShaderRHI; FRHIPixelShader* PixelShaderRHI; } BoundShaderState;
    EPrimitiveType PrimitiveType;
};
class FRHICommandList {
public:
    void SetViewport(float minX, float minY, float minZ, float maxX, float maxY, float maxZ);
    void ApplyCachedRenderTargets(FGraphicsPipelineStateInitializer& initializer);
    void SetStreamSource(uint32 stream, FRHIBuffer* buffer, uint32 offset);
    void DrawPrimitive(uint32 firstVertex, uint32 primitives, uint32 instances);
};
class FRHICommandListImmediate : public FRHICommandList {};
void SetGraphicsPipelineState(FRHICommandList& list, const FGraphicsPipelineStateInitializer& initializer, uint32 stencil);

// ---- Shaders. The macros name members, as the engine's do; the metadata that they also make is left out.
void AddShaderSourceDirectoryMapping(const FString& virtualDirectory, const FString& realDirectory);
struct FGlobalShaderPermutationParameters { EShaderPlatform Platform; };
class FGlobalShaderMap;
FGlobalShaderMap* GetGlobalShaderMap(ERHIFeatureLevel::Type level);
class FGlobalShader {
public:
    static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& parameters);
};
enum EShaderFrequency { SF_Vertex, SF_Pixel, SF_Compute };
template <class T> class TShaderRef {
public:
    FRHIVertexShader* GetVertexShader() const;
    FRHIPixelShader* GetPixelShader() const;
};
template <class T> class TShaderMapRef : public TShaderRef<T> {
public:
    explicit TShaderMapRef(const FGlobalShaderMap* map);
};
#define DECLARE_GLOBAL_SHADER(kind) public: using FThisShader = kind
#define SHADER_USE_PARAMETER_STRUCT(kind, parent) using FShaderParent = parent
#define IMPLEMENT_GLOBAL_SHADER(kind, file, function, frequency) \
    static_assert(std::is_base_of_v<FGlobalShader, kind> && frequency >= SF_Vertex && file[0] == '/' && function[0] != 0, "a shader")
#define BEGIN_SHADER_PARAMETER_STRUCT(name, api) struct name {
#define END_SHADER_PARAMETER_STRUCT() };
#define SHADER_PARAMETER(type, name) type name;
#define SHADER_PARAMETER_STRUCT_INCLUDE(type, name) type name;
#define SHADER_PARAMETER_RDG_TEXTURE(type, name) FRDGTextureRef name;
#define SHADER_PARAMETER_RDG_BUFFER_SRV(type, name) FRDGBufferSRVRef name;
#define SHADER_PARAMETER_RDG_BUFFER_UAV(type, name) FRDGBufferUAVRef name;
#define RENDER_TARGET_BINDING_SLOTS() FRenderTargetBindingSlots RenderTargets;
template <class T, class Parameters>
void SetShaderParameters(FRHICommandList& list, const TShaderRef<T>& shader, FRHIVertexShader* rhi, const Parameters& parameters);

// ---- Render graph
struct FRDGBufferDesc {
    static FRDGBufferDesc CreateStructuredDesc(uint32 BytesPerElement, uint32 NumElements);
    uint32 GetSize() const;
};
class FRDGBuffer;
class FRDGBufferSRV;
class FRDGBufferUAV;
class FRDGTexture;
using FRDGBufferRef = FRDGBuffer*;
using FRDGBufferSRVRef = FRDGBufferSRV*;
using FRDGBufferUAVRef = FRDGBufferUAV*;
using FRDGTextureRef = FRDGTexture*;
class FRDGPooledBuffer {
public:
    const FRDGBufferDesc Desc;
};
struct FRDGTextureDesc {
    ETextureCreateFlags Flags;
    void Reset();
    static FRDGTextureDesc Create2D(FIntPoint size, EPixelFormat format, FClearValueBinding clear, ETextureCreateFlags flags);
};
class FRDGTexture {
public:
    const FRDGTextureDesc Desc;
};
struct FRenderTargetBinding {
    FRenderTargetBinding();
    FRenderTargetBinding(FRDGTextureRef texture, ERenderTargetLoadAction load);
};
struct FDepthStencilBinding {
    FDepthStencilBinding();
    FDepthStencilBinding(FRDGTextureRef texture, ERenderTargetLoadAction depthLoad, FExclusiveDepthStencil access);
};
struct FRenderTargetBindingSlots {
    FRenderTargetBinding& operator[](uint32 index);
    FDepthStencilBinding DepthStencil;
};
struct FRDGEventName { explicit FRDGEventName(const char* name); };
#define RDG_EVENT_NAME(name) FRDGEventName(name)
#define RDG_EVENT_SCOPE(builder, name) FRDGEventName scope_stub(((void)(builder), name))
enum class ERDGPassFlags { Raster };
class FRDGBuilder {
public:
    template <class T> T* AllocParameters();
    template <class Parameters, class Execute>
    void AddPass(FRDGEventName&& name, const Parameters* parameters, ERDGPassFlags flags, Execute&& execute) {
        FRHICommandList& list = list_stub();
        execute(list);
    }
    FRDGBufferRef CreateBuffer(const FRDGBufferDesc& desc, const TCHAR* name);
    FRDGTextureRef CreateTexture(const FRDGTextureDesc& desc, const TCHAR* name);
    FRDGBufferSRVRef CreateSRV(FRDGBufferRef buffer);
    FRDGBufferUAVRef CreateUAV(FRDGBufferRef buffer);
    FRDGBufferRef RegisterExternalBuffer(const TRefCountPtr<FRDGPooledBuffer>& pooled);
    const TRefCountPtr<FRDGPooledBuffer>& ConvertToExternalBuffer(FRDGBufferRef buffer);

private:
    FRHICommandList& list_stub();
};
FRDGBufferRef CreateStructuredBuffer(FRDGBuilder& builder, const TCHAR* name, uint32 BytesPerElement, uint32 NumElements,
                                     const void* InitialData, uint64 InitialDataSize);
void AddClearUAVPass(FRDGBuilder& builder, FRDGBufferUAVRef buffer, uint32 value);
struct FComputeShaderUtils {
    template <class T>
    static void AddPass(FRDGBuilder& builder, FRDGEventName&& name, const TShaderRef<T>& shader, typename T::FParameters* parameters,
                        FIntVector groups);
};
struct FPixelShaderUtils {
    template <class T>
    static void AddFullscreenPass(FRDGBuilder& builder, const FGlobalShaderMap* map, FRDGEventName&& name, const TShaderRef<T>& shader,
                                  typename T::FParameters* parameters, const FIntRect& viewport, FRHIBlendState* blend = nullptr,
                                  FRHIRasterizerState* rasterizer = nullptr, FRHIDepthStencilState* depth = nullptr);
};
#define ENQUEUE_RENDER_COMMAND(name) EnqueueStub{},
struct EnqueueStub {};
template <class Command> void operator,(EnqueueStub, Command&& run) {
    FRHICommandListImmediate& list = *static_cast<FRHICommandListImmediate*>(nullptr);
    run(list);
}

// ---- Views
struct FSceneViewInitOptions {
    FVector ViewOrigin;
    FMatrix ViewRotationMatrix;
    FMatrix ProjectionMatrix;
};
struct FSceneViewFamily {};
class FSceneView {
public:
    FSceneViewInitOptions SceneViewInitOptions;
    ERHIFeatureLevel::Type GetFeatureLevel() const;
};
namespace UE::FXRenderingUtils { FIntRect GetRawViewRectUnsafe(const FSceneView& view); }
struct FScreenPassTextureSlice {};
struct FScreenPassTexture {
    FRDGTextureRef Texture;
    FIntRect ViewRect;
    bool IsValid() const;
    static FScreenPassTexture CopyFromSlice(FRDGBuilder& builder, const FScreenPassTextureSlice& slice);
};
struct FScreenPassRenderTarget : FScreenPassTexture {
    FScreenPassRenderTarget();
    FScreenPassRenderTarget(FRDGTextureRef InTexture, FIntRect InViewRect, ERenderTargetLoadAction InLoadAction);
    FRenderTargetBinding GetRenderTargetBinding() const;
};
struct FSceneTextureUniformParameters { FRDGTextureRef SceneDepthTexture; };
template <class T> class TRDGParameterStructStub {
public:
    const T* operator->() const;
};
template <class T> class TRDGUniformBuffer {
public:
    TRDGParameterStructStub<T> GetParameters() const;
};
template <class T> using TRDGUniformBufferRef = TRDGUniformBuffer<T>*;
struct FSceneTextureShaderParameters { TRDGUniformBufferRef<FSceneTextureUniformParameters> SceneTextures; };
enum class EPostProcessMaterialInput { SceneColor };
struct FPostProcessMaterialInputs {
    FScreenPassRenderTarget OverrideOutput;
    FSceneTextureShaderParameters SceneTextures;
    FScreenPassTextureSlice GetInput(EPostProcessMaterialInput input) const;
    FScreenPassTexture ReturnUntouchedSceneColorForPostProcessing(FRDGBuilder& builder) const;
};
class FPassDelegateStub {
public:
    template <class T>
    void BindRaw(T* object, FScreenPassTexture (T::*method)(FRDGBuilder&, const FSceneView&, const FPostProcessMaterialInputs&));
};
#if ENGINE_MINOR_VERSION >= 6
using FPostProcessingPassDelegateArray = TArray<FPassDelegateStub>;
#else
using FAfterPassCallbackDelegateArray = TArray<FPassDelegateStub>;
#endif
class ISceneViewExtension {
public:
    enum class EPostProcessingPass { MotionBlur, Tonemap, FXAA };
    virtual ~ISceneViewExtension();
#if ENGINE_MINOR_VERSION >= 6
    virtual void SetupViewFamily(FSceneViewFamily& InViewFamily);
    virtual void SetupView(FSceneViewFamily& InViewFamily, FSceneView& InView);
    virtual void BeginRenderViewFamily(FSceneViewFamily& InViewFamily);
    virtual void SubscribeToPostProcessingPass(EPostProcessingPass Pass, const FSceneView& InView,
                                               FPostProcessingPassDelegateArray& InOutPassCallbacks, bool bIsPassEnabled);
#else
    virtual void SetupViewFamily(FSceneViewFamily& InViewFamily) = 0;
    virtual void SetupView(FSceneViewFamily& InViewFamily, FSceneView& InView) = 0;
    virtual void BeginRenderViewFamily(FSceneViewFamily& InViewFamily) = 0;
#if ENGINE_MINOR_VERSION == 5
    virtual void SubscribeToPostProcessingPass(EPostProcessingPass Pass, const FSceneView& InView,
                                               FAfterPassCallbackDelegateArray& InOutPassCallbacks, bool bIsPassEnabled);
#else
    virtual void SubscribeToPostProcessingPass(EPostProcessingPass Pass, FAfterPassCallbackDelegateArray& InOutPassCallbacks,
                                               bool bIsPassEnabled);
#endif
#endif
};
class FAutoRegister {};
class FSceneViewExtensionBase : public ISceneViewExtension, public TSharedFromThis<FSceneViewExtensionBase, ESPMode::ThreadSafe> {};
class FWorldSceneViewExtension : public FSceneViewExtensionBase {
public:
    FWorldSceneViewExtension(const FAutoRegister& AutoReg, UWorld* InWorld);
};
class FSceneViewExtensions {
public:
    template <class T, class... Args> static TSharedRef<T, ESPMode::ThreadSafe> NewExtension(Args&&... args) {
        static_assert(std::is_constructible_v<T, const FAutoRegister&, Args...> && !std::is_abstract_v<T>, "an extension");
        return TSharedRef<T, ESPMode::ThreadSafe>();
    }
};
