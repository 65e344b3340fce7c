// Stubs of Unreal's module UnrealEd.
#pragma once
#include "engine.h"

namespace EReimportResult { enum Type { Failed, Succeeded, Cancelled }; }
class FReimportHandler {
public:
    virtual ~FReimportHandler();
    virtual bool CanReimport(UObject* Obj, TArray<FString>& OutFilenames) = 0;
    virtual void SetReimportPaths(UObject* Obj, const TArray<FString>& NewReimportPaths) = 0;
    virtual EReimportResult::Type Reimport(UObject* Obj) = 0;
};
class UFactory : public UObject {
public:
    TSubclassOf<UObject> SupportedClass = nullptr;
    TArray<FString> Formats;
    bool bEditorImport, bCreateNew;
    virtual UObject* FactoryCreateFile(UClass* InClass, UObject* InParent, FName InName, EObjectFlags Flags, const FString& Filename,
                                       const TCHAR* Parms, FFeedbackContext* Warn, bool& bOutOperationCanceled);
};
