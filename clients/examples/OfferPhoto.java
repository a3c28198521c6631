import java.math.BigInteger;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.nio.file.Path;
import java.security.KeyFactory;
import java.security.MessageDigest;
import java.security.PrivateKey;
import java.security.PublicKey;
import java.security.Signature;
import java.security.spec.EdECPrivateKeySpec;
import java.security.spec.NamedParameterSpec;
import java.security.spec.X509EncodedKeySpec;
import java.util.Arrays;
import java.util.Base64;
import java.util.Locale;
import lcm.lcm.LCM;
import lcm.lcm.LCMDataInputStream;
import lcm.lcm.LCMDataOutputStream;
import lcm.lcm.LCMEncodable;
import lcm.lcm.LCMSubscriber;
import skein.blob_chunk_t;
import skein.blob_request_t;
import skein.image_ack_t;
import skein.image_offer_t;

/**
 * Offers one photo to a session, signed, and sends its bytes. It needs what a program of one's own
 * has: lcm-gen's types, lcm.jar and the JDK's Ed25519 (Java 15).
 *
 * <pre>
 * jars=/usr/share/java/lcm.jar:build/release/skein_lcmtypes.jar
 * java -Djava.net.preferIPv4Stack=true -cp $jars clients/examples/OfferPhoto.java LINK PHOTO
 * </pre>
 *
 * LINK is printed by `skein invite --session DIR --role agent`. Exit codes: 0 the photo is stored or
 * was there already, 1 it was refused or an error, 2 bad usage.
 */
public class OfferPhoto implements LCMSubscriber {
  static final byte[] IDENTIFIER = "SKN1".getBytes(StandardCharsets.US_ASCII);
  static final byte INGEST = 1; // role
  // Of X.509's form of an Ed25519 key, which the key itself follows.
  static final byte[] KEY_PREFIX = new BigInteger("302a300506032b6570032100", 16).toByteArray();

  /** skein://HOST:PORT/PROVIDER/SESSION/ROLE/NAME/CODE */
  static class Invitation {
    final String provider, host, session, name;
    final int port;
    final byte[] certificate;
    final PublicKey root;
    final PrivateKey key;

    Invitation(String link) throws Exception {
      if (!link.startsWith("skein://")) throw new IllegalArgumentException("no skein:// link");
      final String[] parts = link.substring(8).split("/");
      if (parts.length != 6) throw new IllegalArgumentException("the link is cut");
      if (parts[1].equals("tcpqs")) {
        throw new IllegalArgumentException(
            "LCM's library has no TLS: join the session with `skein agent`");
      }
      host = parts[0].substring(0, parts[0].indexOf(':'));
      port = Integer.parseInt(parts[0].substring(parts[0].indexOf(':') + 1));
      provider = parts[1];
      session = parts[2];
      name = parts[4];
      final byte[] code = Base64.getUrlDecoder().decode(parts[5]); // root's key, seed, certificate
      root = publicKey(Arrays.copyOf(code, 32));
      key =
          KeyFactory.getInstance("Ed25519")
              .generatePrivate(
                  new EdECPrivateKeySpec(
                      NamedParameterSpec.ED25519, Arrays.copyOfRange(code, 32, 64)));
      certificate = Arrays.copyOfRange(code, 64, code.length);
    }

    String url(int portOffset) {
      final String address = "://" + host + ":" + (port + portOffset);
      return provider.startsWith("udpm")
          ? "udpm" + address + "?ttl=" + provider.substring(5)
          : provider + address;
    }
  }

  static PublicKey publicKey(byte[] raw) throws Exception {
    final ByteBuffer encoded = ByteBuffer.allocate(KEY_PREFIX.length + raw.length);
    encoded.put(KEY_PREFIX).put(raw);
    return KeyFactory.getInstance("Ed25519")
        .generatePublic(new X509EncodedKeySpec(encoded.array()));
  }

  final Invitation invitation;
  final byte[] photo;
  final image_offer_t offer = new image_offer_t();
  final LCM main, bulk;
  long counter = 0;
  image_ack_t decided; // guarded by this

  OfferPhoto(Invitation invitation, Path path) throws Exception {
    this.invitation = invitation;
    photo = Files.readAllBytes(path);
    offer.session_id = invitation.session;
    offer.agent = invitation.name;
    offer.name = path.getFileName().toString();
    offer.size_bytes = photo.length;
    final byte[] hash = MessageDigest.getInstance("SHA-256").digest(photo);
    offer.blob_id = String.format("%064x", new BigInteger(1, hash));
    offer.owner = "agent." + invitation.name;
    main = new LCM(invitation.url(0));
    bulk = new LCM(invitation.url(1));
    main.subscribe("SKEIN_IMAGE_ACK", this);
    main.subscribe(requestChannel(offer.owner), this);
  }

  /**
   * Requests for an owner's blobs come here (BlobRequestChannel in libs/net/transport/channels.h). A
   * name in an invitation is short enough to be there whole.
   */
  static String requestChannel(String owner) {
    return "SKEIN_BLOB_REQUEST_" + owner.toUpperCase(Locale.ROOT).replaceAll("[^A-Z0-9]", "_");
  }

  /** Repeats the offer until ingest has decided. */
  synchronized image_ack_t run() throws Exception {
    while (decided == null) {
      publish(main, "SKEIN_IMAGE_OFFER", offer);
      wait(500);
    }
    return decided;
  }

  /** The message, then its trailer (libs/net/auth/message_seal.h). */
  synchronized void publish(LCM bus, String channel, LCMEncodable message) throws Exception {
    final LCMDataOutputStream encoded = new LCMDataOutputStream();
    message.encode(encoded);
    final byte[] payload = Arrays.copyOf(encoded.getBuffer(), encoded.size());
    final int trailer = 8 + invitation.certificate.length + 8 + 64 + 2 + 4;
    final ByteBuffer out =
        ByteBuffer.allocate(payload.length + trailer).order(ByteOrder.LITTLE_ENDIAN);
    out.put(payload).putLong(Long.parseUnsignedLong(invitation.session, 16));
    out.put(invitation.certificate).putLong(nextCounter());
    final Signature signature = Signature.getInstance("Ed25519");
    signature.initSign(invitation.key);
    signature.update(context(channel));
    signature.update(out.array(), 0, out.position());
    out.put(signature.sign()).putShort((short) trailer).put(IDENTIFIER);
    bus.publish(channel, out.array(), 0, out.position());
  }

  /** What is signed before the message: each part with a zero at its end. */
  byte[] context(String channel) {
    final String parts = "skein-message-1\0" + invitation.session + "\0" + channel + "\0";
    return parts.getBytes(StandardCharsets.US_ASCII);
  }

  long nextCounter() {
    counter = Math.max(counter + 1, System.currentTimeMillis() * 1_000_000);
    return counter;
  }

  @Override
  public void messageReceived(LCM lcm, String channel, LCMDataInputStream in) {
    try {
      final byte[] message = new byte[in.available()];
      in.readFully(message);
      if (!isFromIngest(channel, message)) return;
      if (channel.equals("SKEIN_IMAGE_ACK")) onAck(message);
      else onRequest(new blob_request_t(message));
    } catch (Exception error) {
      System.err.println("OfferPhoto: " + channel + ": " + error);
    }
  }

  synchronized void onAck(byte[] message) throws Exception {
    final image_ack_t ack = new image_ack_t(message);
    if (!ack.session_id.equals(offer.session_id) || !ack.agent.equals(offer.agent)) return;
    if (!ack.name.equals(offer.name) || !ack.blob_id.equals(offer.blob_id)) return;
    if (ack.status == image_ack_t.WAIT) return;
    decided = ack;
    notifyAll();
  }

  /**
   * Whether the message ends with a trailer of ingest's that the session's root vouches for. A
   * repeated answer does no harm here, so that its counter is not looked at.
   */
  boolean isFromIngest(String channel, byte[] message) throws Exception {
    final int size = message.length;
    if (size < 6 || !Arrays.equals(Arrays.copyOfRange(message, size - 4, size), IDENTIFIER)) {
      return false;
    }
    final ByteBuffer in = ByteBuffer.wrap(message).order(ByteOrder.LITTLE_ENDIAN);
    final int first = size - (in.getShort(size - 6) & 0xffff) + 8; // of the certificate
    if (first < 0 || first + 2 > size || message[first] != INGEST) return false;
    final int claims = 2 + (message[first + 1] & 0xff) + 8 + 32;
    if (first + claims + 64 + 8 + 64 + 6 != size) return false;
    final Signature byRoot = Signature.getInstance("Ed25519");
    byRoot.initVerify(invitation.root);
    byRoot.update(
        ("skein-certificate-1\0" + invitation.session + "\0").getBytes(StandardCharsets.US_ASCII));
    byRoot.update(message, first, claims);
    if (!byRoot.verify(message, first + claims, 64)) return false;
    final Signature byIngest = Signature.getInstance("Ed25519");
    byIngest.initVerify(
        publicKey(Arrays.copyOfRange(message, first + claims - 32, first + claims)));
    byIngest.update(context(channel));
    byIngest.update(message, 0, size - 6 - 64);
    return byIngest.verify(message, size - 6 - 64, 64);
  }

  void onRequest(blob_request_t request) throws Exception {
    if (!request.session_id.equals(offer.session_id) || !request.owner.equals(offer.owner)) return;
    if (!request.blob_id.equals(offer.blob_id) || request.max_chunk_bytes <= 0) return;
    final int step = Math.min(request.max_chunk_bytes, 24 << 10);
    final long last = Math.min(photo.length, request.offset + request.length);
    for (long offset = Math.max(0, request.offset); offset < last; offset += step) {
      final blob_chunk_t chunk = new blob_chunk_t();
      chunk.session_id = offer.session_id;
      chunk.blob_id = offer.blob_id;
      chunk.status = blob_chunk_t.OK;
      chunk.total_bytes = photo.length;
      chunk.offset = offset;
      chunk.size = (int) Math.min(step, last - offset);
      chunk.data = Arrays.copyOfRange(photo, (int) offset, (int) offset + chunk.size);
      publish(bulk, request.reply_channel, chunk);
    }
  }

  public static void main(String[] args) throws Exception {
    if (args.length != 2) {
      System.err.println("usage: OfferPhoto LINK PHOTO");
      System.exit(2);
    }
    final image_ack_t ack = new OfferPhoto(new Invitation(args[0]), Path.of(args[1])).run();
    System.out.println(ack.name + ": status " + ack.status + ", photo " + ack.image_id + " " + ack.reason);
    System.exit(ack.status == image_ack_t.REFUSED ? 1 : 0);
  }
}
