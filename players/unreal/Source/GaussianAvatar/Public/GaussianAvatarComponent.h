#pragma once
#include <memory>

#include "Components/PrimitiveComponent.h"
#include "CoreMinimal.h"
#include "LiveLinkTypes.h"

#include "GaussianAvatarComponent.generated.h"

class UGaussianAvatarAsset;
class FGaussianAvatarExtension;
namespace avatar_unreal { class PoseLayers; }

/**
 * Shows an avatar. Its face looks along +X. For each value the last of these that sets it wins: the clip; keys
 * (UGaussianAvatarExpression, UGaussianAvatarJoint); Blueprint and C++; a live face, which sets what the file maps.
 */
UCLASS(ClassGroup = (Rendering), meta = (BlueprintSpawnableComponent))
class GAUSSIANAVATAR_API UGaussianAvatarComponent : public UPrimitiveComponent
{
	GENERATED_BODY()

public:
	UGaussianAvatarComponent();

	/** What is shown. */
	UPROPERTY(EditAnywhere, BlueprintReadOnly, Category = "Avatar")
	TObjectPtr<UGaussianAvatarAsset> Avatar;

	/** The clip that is played; None: the pose at rest. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Avatar")
	FName Clip;

	/** Where in the clip, seconds. Sequencer can key it; turn Playing off then. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Interp, Category = "Avatar")
	float ClipSeconds = 0;

	/** Whether ClipSeconds runs on by itself in a game, from the end to the beginning again. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Avatar")
	bool bPlaying = true;

	/** A Live Link subject of a face with ARKit's names. It wins over all else where the file maps it. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Avatar")
	FLiveLinkSubjectName Face;

	/** Shows another avatar. */
	UFUNCTION(BlueprintCallable, Category = "Avatar")
	void SetAvatar(UGaussianAvatarAsset* NewAvatar);

	/** Sets an expression or an eyelid over clip and keys. False without an avatar, and for an unknown name: see the log. */
	UFUNCTION(BlueprintCallable, Category = "Avatar")
	bool SetExpression(FName Name, float Weight);

	/** Turns a joint from its rest, as SetExpression. The axes are Unreal's while the avatar looks along +X. */
	UFUNCTION(BlueprintCallable, Category = "Avatar")
	bool SetJoint(FName Name, FRotator Rotation);

	/** Blueprint sets nothing any more. */
	UFUNCTION(BlueprintCallable, Category = "Avatar")
	void ClearValues();

	virtual void TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* Function) override;
	virtual FBoxSphereBounds CalcBounds(const FTransform& LocalToWorld) const override;

protected:
	virtual void OnRegister() override;
	virtual void OnUnregister() override;

private:
	bool Ready();
	void Start();
	void Stop();
	bool Told(bool bWell);
	void ReadKeys();

	TSharedPtr<FGaussianAvatarExtension, ESPMode::ThreadSafe> Extension;
	std::shared_ptr<avatar_unreal::PoseLayers> Layers;
	uint32 Id = 0;
};

/**
 * One expression or eyelid that Sequencer can key: add it under a UGaussianAvatarComponent, set its name, key Weight.
 * Sequencer keys properties that the class declares, and the names of expressions come from the file; so each key has
 * a component of its own.
 */
UCLASS(ClassGroup = (Rendering), meta = (BlueprintSpawnableComponent))
class GAUSSIANAVATAR_API UGaussianAvatarExpression : public USceneComponent
{
	GENERATED_BODY()

public:
	/** Of an expression or an eyelid. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Avatar")
	FName Expression;

	/** Its weight. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Interp, Category = "Avatar")
	float Weight = 0;
};

/** One joint that Sequencer can key: its relative rotation turns the joint from its rest, as SetJoint does. */
UCLASS(ClassGroup = (Rendering), meta = (BlueprintSpawnableComponent))
class GAUSSIANAVATAR_API UGaussianAvatarJoint : public USceneComponent
{
	GENERATED_BODY()

public:
	/** Of a joint. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Avatar")
	FName Joint;
};
