// Where the server has a photo. Browsers keep pictures by their address, and photo 1 of another session may have stood at
// the same host and port: when the ledger took the photo tells the two apart.
export const photoUrl = ({ id, stored }) => `/api/photos/${id}?v=${stored}`;
export const thumbnailUrl = ({ id, stored }) => `/api/photos/${id}/thumbnail?v=${stored}`;
