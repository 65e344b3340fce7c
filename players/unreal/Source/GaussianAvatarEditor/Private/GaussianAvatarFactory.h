#pragma once
#include "CoreMinimal.h"
#include "EditorReimportHandler.h"
#include "Factories/Factory.h"

#include "GaussianAvatarFactory.generated.h"

/** Imports .avatar files, and imports them again. A file that is not sound is refused with one line; nothing changes. */
UCLASS()
class UGaussianAvatarFactory : public UFactory, public FReimportHandler
{
	GENERATED_BODY()

public:
	UGaussianAvatarFactory();

	virtual UObject* FactoryCreateFile(UClass* Class, UObject* Parent, FName Name, EObjectFlags Flags, const FString& Filename,
		const TCHAR* Parms, FFeedbackContext* Warn, bool& bOutOperationCanceled) override;

	virtual bool CanReimport(UObject* Object, TArray<FString>& OutFilenames) override;
	virtual void SetReimportPaths(UObject* Object, const TArray<FString>& NewReimportPaths) override;
	virtual EReimportResult::Type Reimport(UObject* Object) override;
};
