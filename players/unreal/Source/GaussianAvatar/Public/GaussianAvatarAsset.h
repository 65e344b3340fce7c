#pragma once
#include <memory>

#include "CoreMinimal.h"
#include "UObject/Object.h"

#include "GaussianAvatarAsset.generated.h"

class UAssetImportData;
struct AvatarPack;

/** A pack (NAME.avatar): the file's own bytes, checked whole when they are loaded. Components share it. */
UCLASS(BlueprintType)
class GAUSSIANAVATAR_API UGaussianAvatarAsset : public UObject
{
	GENERATED_BODY()

public:
	/** Takes a file after checking it. False for one that is not sound: then Error is one line, and nothing changes. */
	bool Load(TArray<uint8>&& File, const FString& FileName, FString& Error);

	/** The checked pack; null for an asset that never loaded a sound file. */
	std::shared_ptr<const AvatarPack> GetPack() const { return Pack; }

	/** What the person shown agreed to. Empty where the pack does not say. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, AssetRegistrySearchable, Category = "Gaussian Avatar")
	FString Consent;

	/** What the avatar may be used for. Empty where the pack does not say. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, AssetRegistrySearchable, Category = "Gaussian Avatar")
	FString License;

	/** Names for SetExpression. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category = "Gaussian Avatar")
	TArray<FName> Expressions;

	/** Names for SetEyelid. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category = "Gaussian Avatar")
	TArray<FName> Eyelids;

	/** Names for SetJoint. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category = "Gaussian Avatar")
	TArray<FName> Joints;

	/** Names for PlayClip. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category = "Gaussian Avatar")
	TArray<FName> Clips;

#if WITH_EDITORONLY_DATA
	/** Where the file was, for its next import. */
	UPROPERTY(VisibleAnywhere, Instanced, Category = "Import Settings")
	TObjectPtr<UAssetImportData> AssetImportData;
#endif

	virtual void Serialize(FArchive& Archive) override;
	virtual void PostLoad() override;

private:
	void ReadFacts();

	TArray<uint8> Bytes; // the whole file: it is saved, and cooked, as it is
	std::shared_ptr<const AvatarPack> Pack;
};
