package lcm.spy;

import java.awt.Rectangle;
import java.awt.Robot;
import java.awt.Toolkit;
import java.io.File;
import javax.imageio.ImageIO;
import javax.swing.SwingUtilities;

/**
 * Runs the stock lcm-spy and exits 0 once it has decoded a message of a type, 1 after a deadline.
 * It lives in lcm.spy to read the table that the window shows.
 *
 * <p>Arguments: URL CHANNEL TYPE FIELD VALUE DEADLINE_S [SCREENSHOT.png]
 */
public class SpyCheck {
  public static void main(String[] args) throws Exception {
    final Spy spy = new Spy(args[0]);
    final long deadlineMs = System.currentTimeMillis() + 1000 * Long.parseLong(args[5]);
    while (!isDecoded(spy, args[1], args[2], args[3], args[4])) {
      if (System.currentTimeMillis() > deadlineMs) {
        System.out.println("not decoded: " + args[1] + " as " + args[2] + "; channels seen:");
        for (ChannelData seen : spy.channelList) System.out.println("  " + seen.name + " " + seen.cls);
        System.exit(1);
      }
      Thread.sleep(100);
    }
    System.out.println("lcm-spy decodes " + args[1] + " as " + args[2]);
    if (args.length > 6) takeScreenshot(spy, args[1], new File(args[6]));
    System.exit(0);
  }

  static boolean isDecoded(Spy spy, String channel, String type, String field, String value)
      throws Exception {
    final ChannelData data = spy.channelMap.get(channel);
    if (data == null || data.cls == null || data.last == null || data.nerrors > 0) return false;
    final Object decoded = data.last.getClass().getField(field).get(data.last);
    return data.cls.getName().equals(type) && value.equals(String.valueOf(decoded));
  }

  /** With the channel's window open, as a double-click opens it. */
  static void takeScreenshot(Spy spy, String channel, File file) throws Exception {
    SwingUtilities.invokeAndWait(
        () -> {
          final ChannelData data = spy.channelMap.get(channel);
          spy.createViewer(data);
          data.viewerFrame.setLocation(820, 20);
        });
    final long enough = spy.channelMap.get(channel).nreceived + 5;
    while (spy.channelMap.get(channel).nreceived < enough) Thread.sleep(100);
    final Rectangle screen = new Rectangle(Toolkit.getDefaultToolkit().getScreenSize());
    ImageIO.write(new Robot().createScreenCapture(screen), "png", file);
  }
}
