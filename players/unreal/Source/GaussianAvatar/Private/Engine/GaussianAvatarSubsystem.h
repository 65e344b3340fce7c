#pragma once
#include "CoreMinimal.h"
#include "Subsystems/WorldSubsystem.h"

#include "GaussianAvatarSubsystem.generated.h"

class FGaussianAvatarExtension;

/** Holds the view extension of a world. */
UCLASS()
class UGaussianAvatarSubsystem : public UWorldSubsystem
{
	GENERATED_BODY()

public:
	virtual void Deinitialize() override;

	/** The extension, made with the first avatar. Null where nothing is ever drawn: a dedicated server, a cook. */
	TSharedPtr<FGaussianAvatarExtension, ESPMode::ThreadSafe> GetExtension();

protected:
	/** Also the worlds of previews, as in the viewport of a Blueprint. */
	virtual bool DoesSupportWorldType(const EWorldType::Type WorldType) const override { return true; }

private:
	TSharedPtr<FGaussianAvatarExtension, ESPMode::ThreadSafe> Extension;
};
