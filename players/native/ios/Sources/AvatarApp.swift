import MetalKit
import SwiftUI

/// Plays the first clip of head.avatar. A finger turns the avatar, two fingers come nearer.
@main
struct AvatarApp: App {
    var body: some Scene {
        WindowGroup { AvatarScreen().ignoresSafeArea() }
    }
}

struct AvatarScreen: View {
    // Once: SwiftUI makes the values of views anew whenever it likes.
    private static let made = Result { try AvatarRenderer(named: "head") }
    @State private var turned = CGSize.zero
    @State private var zoomed = 1.0

    var body: some View {
        switch Self.made {
        case .failure(let error):
            Text(error.localizedDescription).padding()
        case .success(let renderer):
            MetalView(renderer: renderer)
                .gesture(DragGesture()
                    .onChanged { drag in
                        renderer.turn = -0.005 * Double(turned.width + drag.translation.width)
                        renderer.tilt = min(max(0.005 * Double(turned.height + drag.translation.height), -1.4), 1.4)
                    }
                    .onEnded { drag in
                        turned.width += drag.translation.width
                        turned.height += drag.translation.height
                    })
                .simultaneousGesture(MagnificationGesture()
                    .onChanged { renderer.zoom = min(max(zoomed * Double($0), 0.5), 8) }
                    .onEnded { zoomed = min(max(zoomed * Double($0), 0.5), 8) })
        }
    }
}

/// The MTKView of a renderer.
struct MetalView: UIViewRepresentable {
    let renderer: AvatarRenderer

    func makeUIView(context: Context) -> MTKView {
        let view = MTKView(frame: .zero, device: renderer.device)
        view.colorPixelFormat = SplatDrawing.screenFormat
        view.delegate = renderer
        return view
    }

    func updateUIView(_ view: MTKView, context: Context) {}
}
