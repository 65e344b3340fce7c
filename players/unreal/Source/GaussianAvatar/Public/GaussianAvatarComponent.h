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
 * Shows an avatar. Its face looks along +X. For each value the last of these that sets it wins: the clip; keys (components
 * below, attached to this one); Blueprint and C++; a live face, which sets what the file maps.
 */
UCLASS(ClassGroup = (Rendering), HideCategories = (Collision, Lighting, Object, Physics), meta = (BlueprintSpawnableComponent))
class GAUSSIANAVATAR_API UGaussianAvatarComponent : public UPrimitiveComponent
{
	GENERATED_BODY()

public:
	UGaussianAvatarComponent();

	/** What is shown. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, BlueprintSetter = SetAvatar, Category = "Gaussian Avatar")
	TObjectPtr<UGaussianAvatarAsset> Avatar;

	/** The clip that is played; None: the pose at rest. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Gaussian Avatar")
	FName Clip;

	/** Where in the clip, seconds. Sequencer can key it; turn Playing off then. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Interp, Category = "Gaussian Avatar", meta = (Units = "s"))
	float ClipSeconds = 0;

	/** Whether ClipSeconds runs on by itself in a game, from the end to the beginning again. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Gaussian Avatar")
	bool bPlaying = true;

	/** A Live Link subject of a face with ARKit's names. It wins over all else where the file maps it. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Gaussian Avatar")
	FLiveLinkSubjectName Face;

	/** Shows another avatar. */
	UFUNCTION(BlueprintCallable, Category = "Gaussian Avatar")
	void SetAvatar(UGaussianAvatarAsset* NewAvatar);

	/** Plays a clip from a time on, seconds. False without an avatar, and for an unknown name: see the log. */
	UFUNCTION(BlueprintCallable, Category = "Gaussian Avatar")
	bool PlayClip(FName ClipName, float StartSeconds = 0);

	/** Sets an expression over clip and keys. False without an avatar, and for an unknown name: see the log. */
	UFUNCTION(BlueprintCallable, Category = "Gaussian Avatar")
	bool SetExpression(FName ExpressionName, float Weight);

	/** Sets an eyelid, as SetExpression. */
	UFUNCTION(BlueprintCallable, Category = "Gaussian Avatar")
	bool SetEyelid(FName EyelidName, float Weight);

	/** Turns a joint from its rest, as SetExpression. The axes are Unreal's while the avatar looks along +X. */
	UFUNCTION(BlueprintCallable, Category = "Gaussian Avatar")
	bool SetJoint(FName JointName, FRotator Rotation);

	/** Takes back what SetExpression, SetEyelid and SetJoint set. */
	UFUNCTION(BlueprintCallable, Category = "Gaussian Avatar")
	void ResetPose();

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
 * An expression that Sequencer can key: attach it to a UGaussianAvatarComponent, set its name, key Weight. Sequencer keys
 * properties that a class declares, and the names of expressions come from the file; so each key has a component of its own.
 */
UCLASS(ClassGroup = (Rendering), meta = (BlueprintSpawnableComponent))
class GAUSSIANAVATAR_API UGaussianAvatarExpressionComponent : public USceneComponent
{
	GENERATED_BODY()

public:
	/** Its name. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Gaussian Avatar")
	FName Expression;

	/** Its weight. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Interp, Category = "Gaussian Avatar")
	float Weight = 0;
};

/** An eyelid that Sequencer can key. */
UCLASS(ClassGroup = (Rendering), meta = (BlueprintSpawnableComponent))
class GAUSSIANAVATAR_API UGaussianAvatarEyelidComponent : public USceneComponent
{
	GENERATED_BODY()

public:
	/** Its name. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Gaussian Avatar")
	FName Eyelid;

	/** Its weight. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Interp, Category = "Gaussian Avatar")
	float Weight = 0;
};

/** A joint that Sequencer can key: its relative rotation turns the joint from its rest, as SetJoint does. */
UCLASS(ClassGroup = (Rendering), meta = (BlueprintSpawnableComponent))
class GAUSSIANAVATAR_API UGaussianAvatarJointComponent : public USceneComponent
{
	GENERATED_BODY()

public:
	/** Its name. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Gaussian Avatar")
	FName Joint;
};
