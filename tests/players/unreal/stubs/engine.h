// Stubs of Unreal's modules Engine and LiveLinkInterface.
#pragma once
#include "core.h"

enum ETickingGroup { TG_PostUpdateWork };
enum ELevelTick { LEVELTICK_All, LEVELTICK_ViewportsOnly };
namespace ECollisionEnabled { enum Type { NoCollision }; }

struct FActorComponentTickFunction {
    bool bCanEverTick;
    ETickingGroup TickGroup;
};
class UActorComponent : public UObject {
public:
    FActorComponentTickFunction PrimaryComponentTick;
    bool bTickInEditor;
    bool IsRegistered() const;
    virtual void TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* ThisTickFunction);

protected:
    virtual void OnRegister();
    virtual void OnUnregister();
};
class USceneComponent : public UActorComponent {
public:
    const TArray<TObjectPtr<USceneComponent>>& GetAttachChildren() const;
    const FTransform& GetComponentTransform() const;
    FRotator GetRelativeRotation() const;
    virtual void UpdateBounds();
    virtual bool ShouldRender() const;
    virtual FBoxSphereBounds CalcBounds(const FTransform& LocalToWorld) const;
};
class UPrimitiveComponent : public USceneComponent {
public:
    virtual void SetCollisionEnabled(ECollisionEnabled::Type NewType);
};

class UWorld : public UObject {
public:
    template <class T> T* GetSubsystem() const;
};
namespace EWorldType { enum Type { Game, Editor, PIE, EditorPreview }; }
class UWorldSubsystem : public UObject {
public:
    virtual void Deinitialize();

protected:
    virtual bool DoesSupportWorldType(const EWorldType::Type WorldType) const;
};

class UAssetImportData : public UObject {
public:
    void Update(const FString& AbsoluteFilename);
    void UpdateFilenameOnly(const FString& InPath);
    void ExtractFilenames(TArray<FString>& AbsoluteFilenames) const;
    FString GetFirstFilename() const;
};
struct FGlobalComponentReregisterContext {
    FGlobalComponentReregisterContext();
    ~FGlobalComponentReregisterContext();
};

struct FLiveLinkSubjectName { FName Name; };
struct FLiveLinkBaseStaticData { TArray<FName> PropertyNames; };
struct FLiveLinkBaseFrameData { TArray<float> PropertyValues; };
struct FLiveLinkDataStub {
    template <class T> const T* Cast() const;
};
struct FLiveLinkSubjectFrameData {
    FLiveLinkDataStub StaticData;
    FLiveLinkDataStub FrameData;
};
template <class T> class TSubclassOf {
public:
    TSubclassOf(UClass* kind);
};
class ULiveLinkRole : public UObject {};
class ULiveLinkBasicRole : public ULiveLinkRole {
public:
    static UClass* StaticClass();
};
class ILiveLinkClient {
public:
    static FName ModularFeatureName;
    virtual bool EvaluateFrame_AnyThread(FLiveLinkSubjectName SubjectName, TSubclassOf<ULiveLinkRole> Role,
                                         FLiveLinkSubjectFrameData& OutFrame) = 0;
};
