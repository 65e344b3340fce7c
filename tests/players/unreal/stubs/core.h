// Stubs of Unreal's modules Core, CoreUObject, Projects. Signatures alone, written for tests; nothing here runs.
#pragma once
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#define ENGINE_MAJOR_VERSION 5
#ifndef ENGINE_MINOR_VERSION
#error "say which release: -DENGINE_MINOR_VERSION=4"
#endif
#define GAUSSIANAVATAR_API
#define WITH_EDITORONLY_DATA 1
#define TEXT(text) u##text

using uint8 = std::uint8_t;
using uint32 = std::uint32_t;
using int32 = std::int32_t;
using uint64 = std::uint64_t;
using int64 = std::int64_t;
using TCHAR = char16_t;
constexpr int32 INDEX_NONE = -1;

// Unreal Header Tool: a test writes NAME.generated.h, which defines what the macro in each class becomes.
#define JOIN_3(a, b, c) a##b##c
#define JOIN(a, b, c) JOIN_3(a, b, c)
#define GENERATED_BODY() JOIN(CURRENT_FILE, __LINE__, _BODY)
#define UCLASS(...)
#define UPROPERTY(...)
#define UFUNCTION(...)

template <class T> std::remove_reference_t<T>&& MoveTemp(T&& value) { return static_cast<std::remove_reference_t<T>&&>(value); }

template <class T> class TArray {
public:
    int32 Num() const;
    int32 Add(const T& item);
    T& AddDefaulted_GetRef();
    void Reset();
    void SetNumZeroed(int32 count);
    T* GetData();
    const T* GetData() const;
    const T& operator[](int32 index) const;
    const T* begin() const;
    const T* end() const;
};

class FString {
public:
    FString();
    FString(const TCHAR* text);
    const TCHAR* operator*() const;
    FString operator+(const TCHAR* more) const;
};
const char* TCHAR_TO_UTF8(const TCHAR* text);
const TCHAR* UTF8_TO_TCHAR(const char* text);

class FName {
public:
    FName();
    FName(const TCHAR* text);
    bool IsNone() const;
    FString ToString() const;
    bool operator==(FName other) const;
};

template <class T> class TRefCountPtr {
public:
    bool IsValid() const;
    T* operator->() const;
};
enum class ESPMode { ThreadSafe };
template <class T, ESPMode Mode> class TSharedRef {
public:
    T& operator*() const;
    T* operator->() const;
};
template <class T, ESPMode Mode> class TSharedPtr {
public:
    TSharedPtr();
    template <class U> TSharedPtr(const TSharedRef<U, Mode>& other);
    bool IsValid() const;
    void Reset();
    T* operator->() const;
    T& operator*() const;
};
template <class T, class U, ESPMode Mode> TSharedRef<T, Mode> StaticCastSharedRef(const TSharedRef<U, Mode>& other);
template <class T, ESPMode Mode> class TSharedFromThis {
public:
    TSharedRef<T, Mode> AsShared();
};
template <class T> class TObjectPtr {
public:
    TObjectPtr();
    TObjectPtr(T* object);
    T* Get() const;
    T* operator->() const;
    operator T*() const;
};

struct FMath {
    template <class T> static T Min(T a, T b);
    template <class T> static T Max(T a, T b);
    static float Fmod(float x, float y);
    static double Fmod(double x, double y);
};
struct FVector {
    double X, Y, Z;
    FVector();
    explicit FVector(double all);
    FVector(double x, double y, double z);
};
struct FVector2f {
    float X, Y;
    FVector2f();
    FVector2f(float x, float y);
    FVector2f operator/(const FVector2f& other) const;
};
struct FVector3f { float X, Y, Z; };
struct FVector4f { float X, Y, Z, W; };
struct FIntPoint {
    int32 X, Y;
    FIntPoint(int32 x, int32 y);
};
struct FIntVector { FIntVector(int32 x, int32 y, int32 z); };
struct FIntRect {
    FIntPoint Min, Max;
    FIntRect();
    FIntRect(FIntPoint min, FIntPoint max);
    int32 Width() const;
    int32 Height() const;
    FIntPoint Size() const;
};
struct FQuat { double X, Y, Z, W; };
struct FRotator { FQuat Quaternion() const; };
struct FMatrix { double M[4][4]; };
struct FTransform { FMatrix ToMatrixWithScale() const; };
struct FBox { FBox(const FVector& low, const FVector& high); };
struct FBoxSphereBounds {
    explicit FBoxSphereBounds(const FBox& box);
    FBoxSphereBounds TransformBy(const FTransform& transform) const;
};

namespace ELogVerbosity { enum Type { Error, Warning, Log }; }
struct FLogCategory {};
#define DECLARE_LOG_CATEGORY_EXTERN(name, verbosity, compiled) extern FLogCategory name
#define DEFINE_LOG_CATEGORY(name) FLogCategory name
void log_stub(const FLogCategory& category, ELogVerbosity::Type verbosity, const TCHAR* format, ...);
#define UE_LOG(category, verbosity, format, ...) log_stub(category, ELogVerbosity::verbosity, format, ##__VA_ARGS__)
class FFeedbackContext {
public:
    void Logf(ELogVerbosity::Type verbosity, const TCHAR* format, ...);
};

enum EObjectFlags { RF_NoFlags };
class UClass {};
extern FFeedbackContext* GWarn;
extern uint64 GFrameCounterRenderThread;
struct FApp { static bool CanEverRender(); };
class FArchive {};
template <class T> FArchive& operator<<(FArchive& archive, TArray<T>& array);
class UObject {
public:
    virtual ~UObject();
    virtual void Serialize(FArchive& Ar);
    virtual void PostLoad();
    FString GetName() const;
    class UWorld* GetWorld() const;
    UClass* GetClass() const;
    UObject* GetOuter() const;
    FName GetFName() const;
    bool MarkPackageDirty() const;
    void MarkAsGarbage();
};
template <class T, class U> T* Cast(U* object);
template <class T> T* NewObject(UObject* outer, const UClass* kind, FName name, EObjectFlags flags);
template <class T> T* NewObject(UObject* outer, FName name);
template <class T> T* FindObject(UObject* outer, const TCHAR* name);

class IModuleInterface {
public:
    virtual ~IModuleInterface();
    virtual void StartupModule();
};
class FDefaultModuleImpl : public IModuleInterface {};
#define IMPLEMENT_MODULE(kind, name) inline IModuleInterface* make_module_##name() { return new kind; }
class IPlugin {
public:
    FString GetBaseDir() const;
};
class IPluginManager {
public:
    static IPluginManager& Get();
    TSharedPtr<IPlugin, ESPMode::ThreadSafe> FindPlugin(const FString& name);
};
struct FPaths {
    static FString Combine(const FString& a, const TCHAR* b);
    static FString GetCleanFilename(const FString& path);
};
struct FFileHelper {
    static bool LoadFileToArray(TArray<uint8>& result, const TCHAR* filename);
};
class IModularFeatures {
public:
    static IModularFeatures& Get();
    bool IsModularFeatureAvailable(FName type) const;
    template <class T> T& GetModularFeature(FName type);
};
