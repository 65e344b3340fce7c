using System;
using System.IO;
using System.Threading.Tasks;
using AvatarExport.Core;
using UnityEngine;
using UnityEngine.Networking;

namespace AvatarExport {
    /// <summary>
    /// Reads packs from a URL or from StreamingAssets, also where these lie in an archive (Android) or on a server
    /// (Web).
    /// </summary>
    internal static class PackDownload {
        /// <summary>The address of a URL, or of a path below StreamingAssets.</summary>
        public static string AddressOf(string urlOrPath) {
            if (urlOrPath.Contains("://")) return urlOrPath;
            string path = Path.Combine(Application.streamingAssetsPath, urlOrPath);
            return path.Contains("://") ? path : new Uri(path).AbsoluteUri;
        }

        /// <summary>
        /// The bytes at an address, without blocking. The task fails with AvatarError that says what the server said.
        /// </summary>
        public static Task<byte[]> Of(string address) {
            var done = new TaskCompletionSource<byte[]>();
            UnityWebRequest request = null;
            try {
                request = UnityWebRequest.Get(address);
                request.SendWebRequest().completed += _ => Finish(request, address, done);
            } catch (Exception error) when (error is InvalidOperationException || error is FormatException) {
                // Unity refuses to ask: http where a project allows https alone, or no address at all.
                if (request != null) request.Dispose();
                done.SetException(new AvatarError("cannot be loaded: " + error.Message, address));
            }
            return done.Task;
        }

        private static void Finish(UnityWebRequest request, string address, TaskCompletionSource<byte[]> done) {
            if (request.result == UnityWebRequest.Result.Success) done.SetResult(request.downloadHandler.data);
            else done.SetException(new AvatarError("cannot be loaded: " + request.error, address));
            request.Dispose();
        }
    }
}
