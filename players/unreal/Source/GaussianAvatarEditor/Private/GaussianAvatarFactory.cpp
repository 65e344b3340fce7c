#include "GaussianAvatarFactory.h"

#include "ComponentReregisterContext.h"
#include "CoreGlobals.h"
#include "EditorFramework/AssetImportData.h"
#include "GaussianAvatarAsset.h"
#include "Misc/FeedbackContext.h"
#include "Misc/FileHelper.h"
#include "Misc/Paths.h"
#include "Modules/ModuleManager.h"

IMPLEMENT_MODULE(FDefaultModuleImpl, GaussianAvatarEditor)

namespace
{
/** Where an asset of this kind came from; null for another object. */
UAssetImportData* SourceOf(UObject* Object)
{
	const UGaussianAvatarAsset* const Asset = Cast<UGaussianAvatarAsset>(Object);
	return Asset != nullptr ? Asset->AssetImportData.Get() : nullptr;
}
}

UGaussianAvatarFactory::UGaussianAvatarFactory()
{
	SupportedClass = UGaussianAvatarAsset::StaticClass();
	Formats.Add(TEXT("avatar;Gaussian avatar"));
	bEditorImport = true;
	bCreateNew = false;
}

UObject* UGaussianAvatarFactory::FactoryCreateFile(UClass* Class, UObject* Parent, FName Name, EObjectFlags Flags,
	const FString& Filename, const TCHAR*, FFeedbackContext* Warn, bool& bOutOperationCanceled)
{
	bOutOperationCanceled = false;
	// An asset of the name is filled anew, not made anew: so it loses nothing where the file is not sound.
	UGaussianAvatarAsset* const Present = FindObject<UGaussianAvatarAsset>(Parent, *Name.ToString());
	UGaussianAvatarAsset* const Asset = Present != nullptr ? Present : NewObject<UGaussianAvatarAsset>(Parent, Class, Name, Flags);
	const FString FileName = FPaths::GetCleanFilename(Filename);
	FString Error = FileName + TEXT(": cannot be read");
	TArray<uint8> File;
	if (!FFileHelper::LoadFileToArray(File, *Filename) || !Asset->Load(MoveTemp(File), FileName, Error))
	{
		Warn->Logf(ELogVerbosity::Error, TEXT("%s"), *Error);
		if (Present == nullptr) Asset->MarkAsGarbage();
		return nullptr;
	}
	if (Asset->AssetImportData == nullptr) Asset->AssetImportData = NewObject<UAssetImportData>(Asset, TEXT("AssetImportData"));
	Asset->AssetImportData->Update(Filename);
	Asset->MarkPackageDirty();
	const FGlobalComponentReregisterContext Reregister; // components in open levels show the new file
	return Asset;
}

bool UGaussianAvatarFactory::CanReimport(UObject* Object, TArray<FString>& OutFilenames)
{
	const UAssetImportData* const Source = SourceOf(Object);
	if (Source != nullptr) Source->ExtractFilenames(OutFilenames);
	return Source != nullptr;
}

void UGaussianAvatarFactory::SetReimportPaths(UObject* Object, const TArray<FString>& NewReimportPaths)
{
	UAssetImportData* const Source = SourceOf(Object);
	if (Source != nullptr && NewReimportPaths.Num() == 1) Source->UpdateFilenameOnly(NewReimportPaths[0]);
}

EReimportResult::Type UGaussianAvatarFactory::Reimport(UObject* Object)
{
	const UAssetImportData* const Source = SourceOf(Object);
	if (Source == nullptr) return EReimportResult::Failed;
	bool bCanceled = false;
	const UObject* const Filled = FactoryCreateFile(Object->GetClass(), Object->GetOuter(), Object->GetFName(), RF_NoFlags,
		Source->GetFirstFilename(), nullptr, GWarn, bCanceled);
	return Filled != nullptr ? EReimportResult::Succeeded : EReimportResult::Failed;
}
