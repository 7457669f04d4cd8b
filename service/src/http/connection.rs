//! A connection: its handshake, and an end for whoever does not take what he asked for.

use core::pin::Pin;
use core::task::{Context, Poll, ready};
use core::time::Duration;
use std::io;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Sleep, sleep, timeout};
use tokio_rustls::TlsAcceptor;

use super::door::Socket;

/// How long a handshake may take.
const HANDSHAKE_MAX: Duration = Duration::from_secs(10);
/// How long nothing may be taken of what is to be said: whoever reads nothing would keep his place for ever.
const STALL_MAX: Duration = Duration::from_secs(10);
/// So much of a request that is no TLS is heard, in bytes.
const HEARD_MAX: usize = 16 << 10;
/// With what a TLS connection begins: a handshake record (RFC 8446, 5.1).
const HANDSHAKE: u8 = 22;
/// What whoever speaks plain HTTP to TLS is told.
const PLAIN: &str = "HTTP/1.1 400 Bad Request\r\ncontent-type: text/plain\r\nconnection: close\r\n\r\n\
                     this place speaks TLS: ask https://\n";

trait Stream: AsyncRead + AsyncWrite + Send {}

impl<S: AsyncRead + AsyncWrite + Send> Stream for S {}

/// A connection that can be spoken by.
pub(super) struct Connection {
    stream: Pin<Box<dyn Stream>>,
    /// Since when nothing was taken.
    stalled: Option<Pin<Box<Sleep>>>,
}

impl Connection {
    /// After its handshake, when it has one.
    pub(super) async fn of(socket: Socket) -> io::Result<Self> {
        match socket {
            Socket::Unix(stream) => Ok(Self::over(stream)),
            Socket::Tcp(stream) => Ok(Self::over(stream)),
            Socket::Tls(mut stream, tls) => {
                let acceptor = TlsAcceptor::from(tls.config());
                let shaken = async {
                    if !speaks_tls(&stream).await? {
                        // What was not heard would cut the answer off.
                        let _ = stream.read(&mut vec![0; HEARD_MAX]).await?;
                        stream.write_all(PLAIN.as_bytes()).await?;
                        return Err(io::ErrorKind::InvalidData.into());
                    }
                    acceptor.accept(stream).await
                };
                Ok(Self::over(timeout(HANDSHAKE_MAX, shaken).await??))
            }
        }
    }

    fn over(stream: impl AsyncRead + AsyncWrite + Send + 'static) -> Self {
        Self {
            stream: Box::pin(stream),
            stalled: None,
        }
    }

    /// What `polled` came to; an error when it has been coming to nothing for too long.
    fn in_time<T>(
        &mut self,
        context: &mut Context<'_>,
        polled: Poll<io::Result<T>>,
    ) -> Poll<io::Result<T>> {
        if polled.is_ready() {
            self.stalled = None;
            return polled;
        }
        let stalled = self
            .stalled
            .get_or_insert_with(|| Box::pin(sleep(STALL_MAX)));
        ready!(stalled.as_mut().poll(context));
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }
}

async fn speaks_tls(stream: &TcpStream) -> io::Result<bool> {
    let mut first = [0];
    let length = stream.peek(&mut first).await?;
    Ok(length == 0 || first[0] == HANDSHAKE)
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        self.stream.as_mut().poll_read(context, buffer)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let polled = self.stream.as_mut().poll_write(context, bytes);
        self.in_time(context, polled)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let polled = self.stream.as_mut().poll_flush(context);
        self.in_time(context, polled)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let polled = self.stream.as_mut().poll_shutdown(context);
        self.in_time(context, polled)
    }
}

#[cfg(test)]
mod tests {
    use tokio::time::Instant;

    use super::*;

    /// In the runtime's own time, which passes when nobody has anything to do.
    fn in_virtual_time(work: impl Future<Output = ()>) {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_time()
            .start_paused(true)
            .build();
        runtime.unwrap().block_on(work);
    }

    #[test]
    fn whoever_reads_nothing_is_left_after_a_while_and_whoever_reads_slowly_is_not() {
        in_virtual_time(async {
            let (mut reader, writer) = tokio::io::duplex(10);
            let mut connection = Connection::over(writer);
            let begun = Instant::now();
            let slow = tokio::spawn(async move {
                for _ in 0..5 {
                    sleep(STALL_MAX * 9 / 10).await;
                    reader.read_exact(&mut [0; 10]).await.unwrap();
                }
                reader
            });
            connection.write_all(&[0; 60]).await.unwrap();
            let _reader = slow.await.unwrap();
            assert!(begun.elapsed() > STALL_MAX * 4);
            let begun = Instant::now();
            let left = connection.write_all(&[0; 60]).await.unwrap_err();
            assert_eq!(left.kind(), io::ErrorKind::TimedOut);
            assert!(begun.elapsed() < STALL_MAX * 2);
        });
    }
}
