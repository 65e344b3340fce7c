import MetalKit
import UIKit

/// A failure: one line.
struct AvatarFailure: LocalizedError {
    let line: String
    var errorDescription: String? { line }

    /// Of the text of a handle, or of nothing.
    init(_ text: UnsafePointer<CChar>?) { line = text.map { String(cString: $0) } ?? "failed without a line" }
    init(line: String) { self.line = line }
}

/// One avatar on the screen: a pose, the passes of a level, the sort, the drawing. All on the main thread. It lives as
/// long as the app, which closes nothing.
final class AvatarRenderer: NSObject, MTKViewDelegate {
    let device: MTLDevice
    /// Radians and a factor.
    var turn = 0.0, tilt = 0.0, zoom = 1.0

    private static let fieldOfView = 0.5
    private let queue: MTLCommandQueue
    private let pack: OpaquePointer
    private let instance: OpaquePointer
    private var facts = AvatarFacts.sized
    private let passes: PassRunner
    private let drawing: SplatDrawing
    private let inFlight = DispatchSemaphore(value: 1)  // buffers are written by the CPU while no frame reads them
    private let began = CACurrentMediaTime()

    /// Opens a pack of the app by its name.
    init(named name: String) throws {
        guard let device = MTLCreateSystemDefaultDevice(), let queue = device.makeCommandQueue() else {
            throw AvatarFailure(line: "this device has no Metal")
        }
        guard let url = Bundle.main.url(forResource: name, withExtension: "avatar") else {
            throw AvatarFailure(line: "\(name).avatar is not in the app")
        }
        let file = try Data(contentsOf: url)
        let opened = file.withUnsafeBytes { avatar_load($0.baseAddress, $0.count, "\(name).avatar", nil) }
        guard let pack = opened, avatar_error(pack) == nil else {
            let failure = AvatarFailure(avatar_error(opened))
            avatar_close(opened)
            throw failure
        }
        let level: UInt32 = 0  // the finest: one is uploaded, and fingers come near
        guard let instance = avatar_instance_open(pack, level, nil), avatar_instance_error(instance) == nil else {
            avatar_close(pack)
            throw AvatarFailure(line: "\(name).avatar cannot be played")
        }
        (self.device, self.queue, self.pack, self.instance) = (device, queue, pack, instance)
        passes = try PassRunner(device: device, pack: pack, level: level)
        drawing = try SplatDrawing(device: device)
        super.init()
        avatar_facts(pack, &facts)
    }

    func mtkView(_ view: MTKView, drawableSizeWillChange size: CGSize) {}

    func draw(in view: MTKView) {
        let width = Int(view.drawableSize.width), height = Int(view.drawableSize.height)
        guard width > 0, height > 0, let drawable = view.currentDrawable, let commands = queue.makeCommandBuffer() else { return }
        inFlight.wait()  // before anything writes a buffer
        commands.addCompletedHandler { [inFlight] _ in inFlight.signal() }
        pose()
        var camera = self.camera(width: width, height: height)
        avatar_update_pose(instance)
        avatar_update_camera(instance, &camera)
        passes.run(in: commands, instance: instance)
        drawing.draw(passes.quads, count: passes.count, in: commands, into: drawable.texture)
        commands.present(drawable)
        commands.commit()
    }

    private func pose() {
        var clip = AvatarClip.sized
        if avatar_clip(pack, 0, &clip) == AVATAR_OK, clip.seconds > 0 {
            avatar_clip_pose(instance, 0, (CACurrentMediaTime() - began).truncatingRemainder(dividingBy: clip.seconds))
        } else {
            avatar_reset_pose(instance)
        }
    }

    private func camera(width: Int, height: Int) -> AvatarCamera {
        var camera = AvatarCamera.sized
        let reach = max(facts.whole_size[0] * Double(height) / Double(width), facts.whole_size[1])
        let distance = 0.6 * reach / tan(Self.fieldOfView / 2) / zoom
        avatar_camera_orbit(&camera, facts.whole_target, distance, turn, tilt, Self.fieldOfView, Int32(width), Int32(height))
        return camera
    }
}
