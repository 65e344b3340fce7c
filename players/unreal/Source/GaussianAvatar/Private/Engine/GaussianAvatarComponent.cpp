#include "GaussianAvatarComponent.h"

#include "Engine/World.h"
#include "Features/IModularFeatures.h"
#include "GaussianAvatarAsset.h"
#include "GaussianAvatarExtension.h"
#include "GaussianAvatarSubsystem.h"
#include "ILiveLinkClient.h"
#include "Roles/LiveLinkBasicRole.h"
#include "unreal_face.h"
#include "unreal_frames.h"

namespace
{
using avatar_unreal::PoseLayers;

std::string Utf8(FName Name) { return TCHAR_TO_UTF8(*Name.ToString()); }

/** Reads the newest frame of a Live Link subject. False where there is none or no name of it is ARKit's. */
bool ReadFace(const FLiveLinkSubjectName& Subject, AvatarFrame& Frame)
{
	IModularFeatures& Features = IModularFeatures::Get();
	if (Subject.Name.IsNone() || !Features.IsModularFeatureAvailable(ILiveLinkClient::ModularFeatureName)) return false;
	ILiveLinkClient& Client = Features.GetModularFeature<ILiveLinkClient>(ILiveLinkClient::ModularFeatureName);
	FLiveLinkSubjectFrameData Data;
	if (!Client.EvaluateFrame_AnyThread(Subject, ULiveLinkBasicRole::StaticClass(), Data)) return false;
	const FLiveLinkBaseStaticData* Names = Data.StaticData.Cast<FLiveLinkBaseStaticData>();
	const FLiveLinkBaseFrameData* Values = Data.FrameData.Cast<FLiveLinkBaseFrameData>();
	if (Names == nullptr || Values == nullptr) return false;
	Frame = {};
	bool bFace = false;
	for (int32 i = 0; i < FMath::Min(Names->PropertyNames.Num(), Values->PropertyValues.Num()); ++i)
	{
		bFace |= avatar_unreal::set_channel(Frame, Utf8(Names->PropertyNames[i]).c_str(), Values->PropertyValues[i]);
	}
	return bFace;
}
}

UGaussianAvatarComponent::UGaussianAvatarComponent()
{
	PrimaryComponentTick.bCanEverTick = true;
	PrimaryComponentTick.TickGroup = TG_PostUpdateWork; // after what moves actors and sets keys
	bTickInEditor = true;
	SetCollisionEnabled(ECollisionEnabled::NoCollision);
}

void UGaussianAvatarComponent::OnRegister()
{
	Super::OnRegister();
	Start();
}

void UGaussianAvatarComponent::OnUnregister()
{
	Stop();
	Super::OnUnregister();
}

/** Values that were set stay while the avatar is the same, also while the component is not registered. */
bool UGaussianAvatarComponent::Ready()
{
	const avatar_unreal::Pack Pack = Avatar != nullptr ? Avatar->GetPack() : nullptr;
	if (Layers && Layers->is_of(Pack)) return true;
	Layers.reset();
	if (!Pack) return false;
	Layers = std::make_shared<PoseLayers>(Pack);
	if (Told(Layers->error().empty())) return true;
	Layers.reset();
	return false;
}

void UGaussianAvatarComponent::Start()
{
	UGaussianAvatarSubsystem* Subsystem = GetWorld() != nullptr ? GetWorld()->GetSubsystem<UGaussianAvatarSubsystem>() : nullptr;
	if (Subsystem == nullptr || !Ready()) return;
	Extension = Subsystem->GetExtension();
	if (Extension.IsValid()) Id = Extension->Add(Avatar->GetPack());
	UpdateBounds();
}

void UGaussianAvatarComponent::Stop()
{
	if (Extension.IsValid()) FGaussianAvatarExtension::Leave(MoveTemp(Extension), Id);
	Extension.Reset();
}

void UGaussianAvatarComponent::SetAvatar(UGaussianAvatarAsset* NewAvatar)
{
	Stop();
	Avatar = NewAvatar;
	if (IsRegistered()) Start();
}

bool UGaussianAvatarComponent::Told(bool bWell)
{
	if (bWell) return true;
	if (const char* Line = Layers->news()) UE_LOG(LogGaussianAvatar, Warning, TEXT("%s: %s"), *GetName(), UTF8_TO_TCHAR(Line));
	return false;
}

bool UGaussianAvatarComponent::PlayClip(FName ClipName, float StartSeconds)
{
	double Length = 0;
	if (!Ready()) return false;
	if (Layers->clip(Utf8(ClipName).c_str(), Length) < 0)
	{
		UE_LOG(LogGaussianAvatar, Warning, TEXT("%s: has no clip %s"), *GetName(), *ClipName.ToString());
		return false;
	}
	Clip = ClipName;
	ClipSeconds = StartSeconds;
	bPlaying = true;
	return true;
}

bool UGaussianAvatarComponent::SetExpression(FName ExpressionName, float Weight)
{
	return Ready() && Told(Layers->set_expression(PoseLayers::script, Utf8(ExpressionName).c_str(), Weight));
}

bool UGaussianAvatarComponent::SetEyelid(FName EyelidName, float Weight)
{
	return Ready() && Told(Layers->set_eyelid(PoseLayers::script, Utf8(EyelidName).c_str(), Weight));
}

bool UGaussianAvatarComponent::SetJoint(FName JointName, FRotator Rotation)
{
	const FQuat Turn = Rotation.Quaternion();
	return Ready() && Told(Layers->set_joint(PoseLayers::script, Utf8(JointName).c_str(), &Turn.X));
}

void UGaussianAvatarComponent::ResetPose()
{
	if (Layers) Layers->clear(PoseLayers::script);
}

void UGaussianAvatarComponent::ReadKeys()
{
	Layers->clear(PoseLayers::keys);
	for (const USceneComponent* Child : GetAttachChildren())
	{
		if (const UGaussianAvatarExpressionComponent* Key = Cast<UGaussianAvatarExpressionComponent>(Child))
		{
			if (!Key->Expression.IsNone()) Told(Layers->set_expression(PoseLayers::keys, Utf8(Key->Expression).c_str(), Key->Weight));
		}
		else if (const UGaussianAvatarEyelidComponent* Lid = Cast<UGaussianAvatarEyelidComponent>(Child))
		{
			if (!Lid->Eyelid.IsNone()) Told(Layers->set_eyelid(PoseLayers::keys, Utf8(Lid->Eyelid).c_str(), Lid->Weight));
		}
		else if (const UGaussianAvatarJointComponent* Joint = Cast<UGaussianAvatarJointComponent>(Child))
		{
			const FQuat Turn = Joint->GetRelativeRotation().Quaternion();
			if (!Joint->Joint.IsNone()) Told(Layers->set_joint(PoseLayers::keys, Utf8(Joint->Joint).c_str(), &Turn.X));
		}
	}
}

void UGaussianAvatarComponent::TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* Function)
{
	Super::TickComponent(DeltaTime, TickType, Function);
	if (!Extension.IsValid()) return;
	double Length = 0;
	const int32 Index = Clip.IsNone() ? INDEX_NONE : Layers->clip(Utf8(Clip).c_str(), Length);
	if (bPlaying && Length > 0 && TickType != LEVELTICK_ViewportsOnly)
	{
		ClipSeconds = static_cast<float>(FMath::Fmod(static_cast<double>(ClipSeconds) + DeltaTime, Length));
	}
	AvatarFrame Frame;
	const bool bFace = ReadFace(Face, Frame);
	ReadKeys();
	Told(Layers->mix(Index, ClipSeconds, bFace ? &Frame : nullptr));
	Extension->Send(Id, Layers->pose(), GetComponentTransform().ToMatrixWithScale(), ShouldRender());
}

FBoxSphereBounds UGaussianAvatarComponent::CalcBounds(const FTransform& LocalToWorld) const
{
	FBox Box(FVector(-100), FVector(100)); // centimetres: what an empty component shows in the editor
	if (Avatar != nullptr && Avatar->GetPack())
	{
		double Low[3], High[3];
		avatar_unreal::pack_box(Avatar->GetPack().get(), Low, High);
		Box = FBox(FVector(Low[0], Low[1], Low[2]), FVector(High[0], High[1], High[2]));
	}
	return FBoxSphereBounds(Box).TransformBy(LocalToWorld);
}
