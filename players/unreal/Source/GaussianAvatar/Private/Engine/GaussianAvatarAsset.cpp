#include "GaussianAvatarAsset.h"

#include "GaussianAvatarExtension.h"
#include "Serialization/Archive.h"
#include "unreal_names.h"
#include "unreal_pose.h"

DEFINE_LOG_CATEGORY(LogGaussianAvatar);

namespace
{
void Take(const std::vector<std::string>& Names, TArray<FName>& Into)
{
	Into.Reset();
	for (const std::string& Name : Names) Into.Add(FName(UTF8_TO_TCHAR(Name.c_str())));
}
}

bool UGaussianAvatarAsset::Load(TArray<uint8>&& File, const FString& FileName, FString& Error)
{
	std::string Line;
	const avatar_unreal::Pack Opened =
		avatar_unreal::open_pack(File.GetData(), static_cast<size_t>(File.Num()), TCHAR_TO_UTF8(*FileName), Line);
	if (!Opened)
	{
		Error = UTF8_TO_TCHAR(Line.c_str());
		return false;
	}
	Bytes = MoveTemp(File);
	Pack = Opened;
	ReadFacts();
	return true;
}

void UGaussianAvatarAsset::ReadFacts()
{
	AvatarFacts Facts = {};
	avatar_facts(Pack.get(), &Facts);
	License = UTF8_TO_TCHAR(Facts.license != nullptr ? Facts.license : "");
	Consent = UTF8_TO_TCHAR(Facts.consent != nullptr ? Facts.consent : "");
	const avatar_unreal::Names Known = avatar_unreal::names_of(Pack.get());
	Take(Known.expressions, Expressions);
	Take(Known.eyelids, Eyelids);
	Take(Known.joints, Joints);
	Take(Known.clips, Clips);
}

void UGaussianAvatarAsset::Serialize(FArchive& Archive)
{
	Super::Serialize(Archive);
	Archive << Bytes;
}

void UGaussianAvatarAsset::PostLoad()
{
	Super::PostLoad();
	FString Error;
	TArray<uint8> File = Bytes;
	if (Bytes.Num() > 0 && !Load(MoveTemp(File), GetName(), Error))
	{
		UE_LOG(LogGaussianAvatar, Error, TEXT("%s"), *Error);
	}
}
